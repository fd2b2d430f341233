"""`langflash lab eval rooms`: the network on rooms with furniture it has never seen, in one command.

Every scene gives two photos to the network and keeps a third as the target view. Depth, pose and
points are judged in the photos, pictures and labels in the photos and in the target view (there
only where a photo sees the surface), phrases in the first photo. Trivial answers are measured in
the same run on the same scenes.

Sizes: V views, H W pixels, K atoms, G class groups, C channels, P phrases.
"""

import logging
import time
from collections.abc import Iterator
from pathlib import Path

from torch import Tensor

from langflash_core.lab.evaluation.lpips import Lpips
from langflash_core.lab.evaluation.rooms.geometry import judge_geometry
from langflash_core.lab.evaluation.rooms.phrases import ask_phrases
from langflash_core.lab.evaluation.rooms.summary import summary
from langflash_core.lab.evaluation.rooms.tally import Setting, Tally
from langflash_core.lab.evaluation.rooms.target import judge_views
from langflash_core.lab.evaluation.rooms.truth import median_depth, opened, records, views_of
from langflash_core.lab.evaluation.sights import Look
from langflash_core.lab.evaluation.tallies import judged, merged
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.shards import RoomRecord
from langflash_core.network import LangFlashNet, load_network

log = logging.getLogger(__name__)


def run_eval(
    data: Path, weights: Path | None = None, *, preset: str = "mini", limit: int | None = None
) -> dict:
    """Judge a checkpoint on `data/held_out` (made by `langflash lab train cache --set held_out`).

    Args:
        data: cache folder; `held_out` is judged, `validation` calibrates the presence threshold
            where the checkpoint brings none, `train` gives the constant-depth baseline.
        limit: only the first so many scenes.

    Returns:
        Plain JSON: "rows" (name -> numbers), "scenes", "seeds", "threshold".

    Raises:
        InputError: there is no such cache. WeightsError: the weights do not fit.
    """
    setting, held_out = open_rooms(data, weights, preset=preset, limit=limit)
    tallies = judged(
        named_records(held_out),
        lambda record, _: judge(setting, record),
        count=len(held_out),
        progress=lambda stage, fraction: log.info("scene %s", stage),
    )
    return {
        "weights": str(weights) if weights else preset,
        "scenes": len(tallies),
        "seeds": [min(map(int, tallies)), max(map(int, tallies))],
        "threshold": setting.threshold,
        "temperature": setting.temperature,
        **summary(merged(list(tallies.values())), setting),
    }


def open_rooms(
    data: Path,
    weights: Path | None = None,
    *,
    preset: str = "mini",
    limit: int | None = None,
    lpips: Lpips | None = None,
) -> tuple[Setting, RoomSet]:
    """What `run_eval` judges with, and the rooms that it judges.

    Raises:
        InputError: there is no such cache. WeightsError: the weights do not fit.
    """
    rooms = opened(data / "held_out", limit)
    network = load_network(preset, weights)
    groups = sorted({label.group for label in rooms.labels()})
    return Setting.of(network, groups, median_depth(data), lpips), rooms


def named_records(rooms: RoomSet) -> Iterator[tuple[str, RoomRecord]]:
    """Seed and room, in order."""
    return ((str(record.seed), record) for record in records(rooms))


def asked_rooms(network: LangFlashNet, data: Path, *, limit: int | None = None) -> Tally:
    """Scores, truths and mask overlaps of phrases in `data/validation`, whose furniture no training saw.

    The sets "there" and "not there" are those of `judge`. Every second question uses another word
    of the vocabulary instead of the plain name, because people do.
    """
    rooms = opened(data / "validation", limit)
    groups = sorted({label.group for label in rooms.labels()})
    plain = Setting.of(network, groups, median_depth=1.0)
    tally = Tally()
    for record in records(rooms):
        views = views_of(record, (0, 1))
        ask_phrases(plain, record, network.predict(views), tally, varied=True)
    return tally


def judge(setting: Setting, record: RoomRecord, look: Look | None = None) -> Tally:
    """Everything about one scene of at least three views."""
    tally = Tally()
    views = views_of(record, (0, 1))
    start = time.perf_counter()
    prediction = setting.network.predict(views)
    tally.note(seconds=time.perf_counter() - start)
    tally.note(**{f"stage_{name}_seconds": value for name, value in prediction.timings.items()})
    truth = record.depths.float()
    scale = true_scale(prediction.depths[0], truth[0])
    judge_geometry(setting, record, prediction, scale, tally)
    ask_phrases(setting, record, prediction, tally)
    judge_views(setting, record, prediction, scale, tally, look)
    return tally


def true_scale(depths: Tensor, truth: Tensor) -> float:
    """True lengths per predicted length: median of z* / z in view 0."""
    valid = (truth > 0) & (depths > 0)
    return float((truth[valid] / depths[valid]).median())
