"""Tallies: adding up, keeping and reading again change nothing, and what was made otherwise is not used."""

import math
from dataclasses import dataclass, field

import pytest
import torch

from langflash_core.lab.evaluation.metrics import PoseError, Presence
from langflash_core.lab.evaluation.tallies import (
    Shelf,
    identity,
    intervals,
    judged,
    merged,
    numbers_of,
    plain,
    revived,
)
from langflash_core.language.leads import FILE as LEADS


@dataclass
class Made:
    numbers: dict[str, list[float]] = field(default_factory=dict)
    counts: dict[tuple[str, str], torch.Tensor] = field(default_factory=dict)
    presence: Presence = field(default_factory=Presence)
    poses: list[PoseError] = field(default_factory=list)
    overlaps: dict[str, tuple[int, int]] = field(default_factory=dict)
    scores: list[torch.Tensor] = field(default_factory=list)


def made(value: float) -> Made:
    return Made(
        {"psnr": [value], "nan": [math.nan]},
        {("atoms", "paper"): torch.tensor([[3, 0], [1, int(value)]])},
        Presence(hits=1, misses=2),
        [PoseError(value, math.nan)],
        {"chair": (1, 2)},
        [torch.tensor([0.25, 0.0, value])],
    )


def test_tallies_add_up():
    both = merged([made(1.0), made(2.0)])
    assert both.numbers["psnr"] == [1, 2] and both.presence == Presence(hits=2, misses=4)
    assert both.counts["atoms", "paper"].tolist() == [[6, 0], [2, 3]]
    assert both.overlaps == {"chair": (2, 4)} and len(both.poses) == len(both.scores) == 2
    only = merged([Made(), made(2.0)])
    assert only.numbers["psnr"] == [2] and only.counts["atoms", "paper"][1, 1] == 2
    with pytest.raises(ValueError, match="at least one"):
        merged([])


def test_what_is_read_again_is_what_was_written(tmp_path):
    shelf = Shelf(tmp_path / "kept", {"weights": "a", "sizes": (3, 4)}, Made)
    shelf.write("one", made(5.0))
    again = shelf.read("one")
    assert again is not None
    assert plain(again) == plain(made(5.0))
    assert again.scores[0].dtype == torch.float32 and math.isnan(again.numbers["nan"][0])
    assert revived(plain(torch.tensor([True, False])), {}).tolist() == [True, False]
    assert revived(plain(torch.zeros(0, 3)), {}).shape == (0, 3)


def test_what_was_made_otherwise_or_is_damaged_is_made_again(tmp_path):
    shelf = Shelf(tmp_path, {"weights": "a"}, Made)
    asked = []

    def judge(value: float, progress) -> Made:
        progress("half", 0.5)
        asked.append(value)
        return made(value)

    items, told = [("one", 1.0), ("two", 2.0)], []
    found = judged(items, judge, count=2, shelf=shelf, progress=lambda *said: told.append(said))
    assert list(found) == ["one", "two"] and told[-1] == ("two: half", 0.75)
    judged(items, judge, shelf=shelf)
    assert asked == [1, 2]
    judged(items, judge, shelf=Shelf(tmp_path, {"weights": "b"}, Made))
    (tmp_path / "one.json").write_text('{"key": {"weights": "b"}, "tally": {"of": "Other"}}')
    judged(items, judge, shelf=Shelf(tmp_path, {"weights": "b"}, Made))
    assert asked == [1, 2, 1, 2, 1]


def test_with_other_leads_tallies_are_made_anew(tmp_path, monkeypatch):
    """With weights that were named, and with those of a preset that does not come with the program."""
    monkeypatch.setattr("langflash_core.base.resources._ROOT", tmp_path)
    leads, weights = tmp_path / "assets" / LEADS, tmp_path / "own.safetensors"
    leads.parent.mkdir(parents=True)
    weights.write_bytes(b"weights")
    found = set()
    for content in (b"some", b"others"):
        leads.write_bytes(content)
        found |= {identity(weights, "mini"), identity(None, "full")}
    assert len(found) == 4


def test_intervals_have_the_paths_of_the_summary():
    def summary(tally: Made) -> dict:
        known = tally.numbers["psnr"]
        return {"measures": {"psnr": sum(known) / len(known), "lpips": None}, "names": ["a"]}

    assert set(numbers_of(summary(made(1.0)))) == {"measures/psnr", "measures/lpips"}
    found = intervals([made(float(n)) for n in range(10)], summary, draws=50)
    low, high = found["measures/psnr"] or (0.0, 0.0)
    assert 2 < low < 4.5 < high < 7 and found["measures/lpips"] is None
