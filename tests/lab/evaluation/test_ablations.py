"""Rivals and studies: groups that are merged and cut keep what they are, decoders fit, the truth wins."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch.nn import functional as F

from langflash_core.lab.evaluation.ablations import study
from langflash_core.lab.evaluation.ablations.groupings import point_groups, regrouped, true_names
from langflash_core.lab.evaluation.ablations.tables import ablation_markdown, ablation_plots, summary
from langflash_core.lab.evaluation.tallies import Shelf, judged
from langflash_core.lab.training.shards import Label, RoomRecord, write_shard
from langflash_core.network import MINI, GuidedDepthNet, save_network
from tests.lab.training.conftest import toy_record

LAMPS = (Label("lamp", "lamp"),) * 4


def toy_room(seed: int) -> RoomRecord:
    return replace(toy_record(seed), tokens=None, token_scales=None)


def patches(colours: int = 4, side: int = 16) -> tuple[torch.Tensor, torch.Tensor]:
    """Two views of stripes: features (1, 2, 24, h, w) that differ by stripe, and which stripe (2, h, w)."""
    generator = torch.Generator().manual_seed(0)
    stripe = (torch.arange(side) * colours // side).expand(2, side, side)
    vectors = F.normalize(torch.randn(colours, 24, generator=generator), dim=-1)
    noise = 0.02 * torch.randn(2, side, side, 24, generator=generator)
    features = F.normalize(vectors[stripe] + noise, dim=-1)
    return features.permute(0, 3, 1, 2)[None], stripe


def test_groups_are_cut_where_features_differ():
    features, stripe = patches()
    one = torch.ones(2, 1, 16, 16)
    cut = regrouped(one, features, 4)
    assert cut.shape == (2, 4, 16, 16)
    assert torch.allclose(cut.sum(1), torch.ones(2, 16, 16))
    found = cut.argmax(1)
    for row in range(4):
        assert len(found[stripe == row].unique()) == 1  # a stripe is one group
    assert len(found.unique()) == 4
    assert regrouped(one, features, 40).shape[1] == 40


def test_groups_are_merged_where_features_agree():
    features, stripe = patches()
    halves = (torch.arange(16) % 2).expand(2, 16, 16)
    fine = F.one_hot(stripe * 2 + halves, 8).float().permute(0, 3, 1, 2)
    merged = regrouped(fine, features, 4)
    assert merged.shape[1] == 4 and torch.equal(merged.sum(1), torch.ones(2, 16, 16))
    for row in range(4):
        assert len(merged.argmax(1)[stripe == row].unique()) == 1
    assert torch.equal(regrouped(fine, features, 8), fine)
    assert regrouped(fine, features, 1).shape[1] == 1


def test_pixels_that_are_alike_cannot_be_cut_for_ever():
    flat = torch.ones(1, 1, 24, 4, 4) / 24**0.5
    assert regrouped(torch.ones(1, 1, 4, 4), flat, 9).shape[1] == 1


def test_points_are_grouped_by_place():
    y, x = torch.meshgrid(torch.arange(32.0), torch.arange(32.0), indexing="ij")
    near, far = torch.stack((x, y, 10 + 0 * x), -1), torch.stack((x + 500, y, 10 + 0 * x), -1)
    groups = point_groups(torch.stack((near, far)), torch.full((2, 32, 32, 3), 0.5), 2)
    assert groups.shape == (2, 2, 32, 32) and torch.equal(groups.sum(1), torch.ones(2, 32, 32))
    assert len(groups[0].argmax(0).unique()) == 1 and int(groups[0].argmax(0)[0, 0]) != int(
        groups[1].argmax(0)[0, 0]
    )


def test_true_names_are_those_of_the_most_weight():
    weights = torch.tensor([[[0.9, 0.6, 0.1]], [[0.1, 0.4, 0.9]]])[None]  # (1, 2, 1, 3)
    classes = torch.tensor([[[2, 2, 1]]])
    assert true_names(weights, classes, 3).tolist() == [2, 1]
    assert true_names(weights, torch.full((1, 1, 3), -1), 3).tolist() == [0, 0]


def test_examples_are_taken_evenly():
    rows = torch.arange(1000.0)[:, None]
    found = study.gathered(iter([(rows, -rows), (rows[:10], rows[:10])]))
    assert len(found.features) == 410 and float(found.features[0]) == 0 and float(found.features[399]) == 999
    assert torch.equal(found.left[:400], -found.features[:400])


def test_what_is_stored_are_the_largest_weights():
    weights = torch.rand(1, 12, 3, 3, generator=torch.Generator().manual_seed(0))
    kept = study.stored(weights)
    assert kept.shape == (9, 12) and int((kept > 0).sum(1).max()) == study.KEPT
    assert torch.allclose(kept.sum(1), torch.ones(9))


@pytest.mark.slow
def test_a_study_measures_every_rival_and_goes_on_from_its_fits(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(study, "GROUPS", (4, 16))
    held_out, train = ([toy_room(seed) for seed in seeds] for seeds in ((0, 1), (2, 3)))
    write_shard(tmp_path / "held_out" / "a.safetensors", held_out)
    write_shard(tmp_path / "train" / "a.safetensors", train)
    torch.manual_seed(0)
    save_network(GuidedDepthNet(MINI), tmp_path / "mini.safetensors")
    shelf = Shelf(tmp_path / "work", {}, study.Tally)
    options = {"limit": 2, "most": 1, "shelf": shelf}

    def studied() -> tuple[int, study.Tally]:
        setting, fits, count, cases = study.opened_study(tmp_path, tmp_path / "mini.safetensors", **options)
        kept = study.grouped_shelf(shelf, setting)
        (tally,) = judged(cases, lambda record, _: study.judge(setting, fits, record), shelf=kept).values()
        return count, tally

    count, tally = studied()
    assert count == 1 and (tmp_path / "work" / study.FITS).is_file()
    result = {"scenes": 1, "weights": "random", **summary(tally)}
    rows = set(result["labels"])
    assert {"features", "splatted", "low_3", "low_64", "residual", "K4/lfa", "K16/average"} <= rows
    assert {f"{g}/{v}" for g in ("points", "sg", "true") for v in ("names", "average", "lfa")} <= rows
    # True masks with true names miss only where splats of two things overlap.
    assert result["labels"]["true/names"]["groups_accuracy"] > 0.5
    best = max(row["groups_accuracy"] for row in result["labels"].values())
    assert result["labels"]["true/names"]["groups_accuracy"] == best
    text = ablation_markdown(result)
    assert "residual channels" in text and "0.7144, 0.8547" not in text  # K = 128 was not asked for
    assert all(plot.points for plot in ablation_plots(result, {}))
    monkeypatch.setattr(study, "judge", lambda setting, fits, record: study.Tally())
    second = studied()[1]
    for key, table in tally.counts.items():
        assert torch.equal(table, second.counts[key])
    lamps = [replace(record, labels=LAMPS) for record in held_out]
    write_shard(tmp_path / "held_out" / "a.safetensors", lamps)
    assert not studied()[1].counts  # other groups, other tables


def test_what_was_fitted_on_is_read_again_for_the_same_source_alone(tmp_path: Path):
    rows = torch.arange(12.0).reshape(3, 4)
    path = tmp_path / study.FITS
    assert study.kept_examples(path, "these weights") is None
    study.keep_examples(path, "these weights", study.Examples(rows, -rows))
    found = study.kept_examples(path, "these weights")
    assert found is not None and torch.equal(found.features, rows) and torch.equal(found.left, -rows)
    assert study.kept_examples(path, "other weights") is None
    path.write_bytes(b"no tensors")
    assert study.kept_examples(path, "these weights") is None
