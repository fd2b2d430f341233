"""The protocol end to end on two toy rooms, with a randomly drawn network; and what it must know."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.geometry.cameras import invert_rigid, unproject
from langflash_core.geometry.harmonics import colour_to_sh
from langflash_core.lab.evaluation.calibration import calibration, rooms_asked
from langflash_core.lab.evaluation.rooms import phrases, run, summary, truth
from langflash_core.lab.evaluation.rooms.tally import Setting, Tally
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.lab.training.shards import Label, write_shard
from langflash_core.language.spaces import language_space
from langflash_core.network import MINI, GuidedDepthNet, load_network, save_network
from langflash_core.types import Gaussians, Prediction
from tests.lab.training.conftest import SIZE, toy_record


@pytest.fixture(scope="module")
def cache(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("cache")
    for name, seeds in (("held_out", (0, 1)), ("validation", (2, 3))):
        records = [replace(toy_record(seed), tokens=None, token_scales=None) for seed in seeds]
        if name == "validation":  # one room holds what the other does not
            records[1] = replace(
                records[1], labels=tuple(Label(g, g) for g in ("lamp", "rug", "bed", "bath"))
            )
        write_shard(folder / name / "a.safetensors", records)
    return folder


@pytest.fixture(scope="module")
def weights(tmp_path_factory) -> Path:
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "mini.safetensors"
    save_network(GuidedDepthNet(MINI), path)
    return path


@pytest.mark.slow
def test_a_run_measures_everything(cache: Path, weights: Path):
    result = run.run_eval(cache, weights)
    assert result["scenes"] == 2
    assert result["seeds"] == [0, 1]
    json.dumps(result, allow_nan=False)
    assert set(result["labels"]) == {
        "features",
        "averaged",
        "averaged_named",
        "lfa",
        "true_masks_lfa",
        "majority",
    }
    measures = result["measures"]
    # The toy rooms: a constant depth is wrong by what the wall, floor and boxes differ.
    assert 0.1 < measures["depth_abs_rel_constant"] < 0.4
    assert measures["presence_f1_always_found"] > 0
    table = markdown(summary.tables(result))
    assert "| Depth AbsRel, view 1 |" in table
    assert table.count("\n|") > 20


@pytest.mark.slow
def test_calibration_is_a_threshold_for_queries(cache: Path, weights: Path):
    network = load_network("mini", weights)
    found = calibration(network, {"rooms": rooms_asked(network, cache)})
    assert 0 < found["threshold"] < 1
    assert found["temperature"] > 0
    assert found["validation"]["rooms"]["phrases"] > 0
    json.dumps(found, allow_nan=False)


def test_a_missing_cache_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="train cache"):
        run.run_eval(tmp_path / "nothing")


def test_the_target_counts_where_a_photo_sees_it():
    record = toy_record(5)
    seen = truth.seen_by_photos(record)
    assert 0.8 < float(seen.float().mean()) < 1
    blind = replace(record, depths=record.depths.clone())
    blind.depths[:2] = 0
    assert not bool(truth.seen_by_photos(blind).any())


def perfect(record) -> Prediction:
    """The prediction that knows the truth: true points, masks and phrases, half the true size."""
    depths = record.depths[:2].float() / 2
    viewmats = record.viewmats[:2].clone()
    viewmats[:, :3, 3] /= 2
    poses = invert_rigid(viewmats)
    points = unproject(depths, record.Ks[:2])
    means = torch.einsum("vij,vhwj->vhwi", poses[:, :3, :3], points) + poses[:, None, None, :3, 3]
    count = 2 * SIZE * SIZE
    colours = record.rgb[:2].permute(0, 2, 3, 1).reshape(-1, 1, 3).float() / 255
    quats = torch.zeros(count, 4)
    quats[:, 0] = 1
    scales = (0.6 * depths / record.Ks[0, 0, 0]).reshape(-1, 1).repeat(1, 3)
    gaussians = Gaussians(
        means.reshape(-1, 3), quats, scales, torch.full((count,), 0.95), colour_to_sh(colours)
    )
    weights = truth.true_masks(record, (0, 1))
    dictionary = language_space("minilm").encode([label.group for label in record.labels])
    return Prediction(gaussians, weights, dictionary, "minilm", viewmats, depths, torch.ones_like(depths))


class Knowing(GuidedDepthNet):
    """Hands out a prediction that is known beforehand; everything else is the network's own."""

    answer: Prediction

    def predict(self, views, progress=None, cancelled=None) -> Prediction:
        return self.answer


@pytest.mark.slow
def test_the_truth_scores_as_the_truth():
    torch.manual_seed(0)
    net = Knowing(MINI).eval()
    record = toy_record(5)
    net.answer = perfect(record)
    setting = Setting.of(net, ["floor", "sofa", "table", "wall", "lamp", "bed"], 2.5)
    tally = run.judge(setting, record)
    result = summary.summary(tally, setting)
    measures, labels = result["measures"], result["labels"]["lfa"]
    assert measures["depth_abs_rel"] < 1e-3  # float16 depths
    assert measures["points_view_1"] < 1e-3
    assert measures["pose_rotation_median"] < 1e-3
    assert measures["pose_direction_median"] < 1e-2  # degrees, float32
    assert measures["presence_recall"] == 1
    assert labels["source_groups_miou"] == pytest.approx(1)
    # Edges blend where Gaussians of two surfaces overlap.
    assert labels["target_groups_accuracy"] > 0.95
    assert measures["psnr"] > 20


def test_other_words_are_judged_by_all_they_are_true_of():
    net = GuidedDepthNet(MINI).eval()
    setting = Setting.of(net, ["chair", "lamp", "sofa", "wall"], 2.5)
    truth = torch.arange(4).repeat_interleave(25)
    maps = setting.texts[truth].reshape(10, 10, -1)
    tally = Tally()
    phrases.note_paraphrases(setting, maps, truth, tally)
    assert {"couch", "seat", "light source"} <= set(tally.paraphrases)
    assert "something to read" not in tally.paraphrases
    (_, seats_by_name), (couch, sofa) = tally.paraphrases["seat"][0], tally.paraphrases["couch"][0]
    assert seats_by_name == pytest.approx(1)  # "chair" or "sofa"
    assert sofa == pytest.approx(1)
    assert couch == pytest.approx(1)
    report = phrases.paraphrase_report(tally)
    assert report["couch"] == {"asked": 1, "iou": 1.0, "name_iou": 1.0}
