"""`langflash lab eval phrases`: phrases as people ask them, of real places, against outlines made by hand.

A *place* is a file of what stands where in some frames of a film: regions, by phrase and frame, and phrases
for what is not there. Outlines are coarse, so a verdict asks little of borders: of a phrase that is there,
over all frames that name it,

    right    most of what is lit lies in its regions, and half of the regions are lit
    partly   some of what is lit lies there
    wrong    something else is lit
    missed   nothing is lit

and of one that is not there, *honest* where no frame lights anything, *claimed* where one does.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool
from torch import Tensor

from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.images.pictures import centre_box
from langflash_core.lab.evaluation.bench import Render
from langflash_core.pipeline import query
from langflash_core.types import QueryResult, Scene

RIGHT, PARTLY, WRONG, MISSED = "right", "partly", "wrong", "missed"
HONEST, CLAIMED = "honest", "claimed"
THERE, ABSENT = (RIGHT, PARTLY, WRONG, MISSED), (HONEST, CLAIMED)
MARGIN = 0.02
"""Of a picture's longer side: how much wider regions are when it is asked what lies in them. Hands err."""
MOST, SOME = 0.6, 0.3
"""Shares of the lit pixels that lie in the regions, of an answer that is right, and of one partly so."""
LIT = 0.2
"""Share of a region that is lit where the thing in it was found: a box round a lamp is half wall."""
SURE = 0.9
"""Score from which a wrong answer is a confident one."""

Region = Sequence[float] | Sequence[Sequence[float]]
"""(left, top, right, bottom), or corners (x, y) of a polygon, in shares of a frame's sides."""


@dataclass(frozen=True)
class Place:
    """there: phrase -> name of a frame without its suffix -> regions. absent: phrases for what is nowhere."""

    name: str
    there: Mapping[str, Mapping[str, Sequence[Region]]]
    absent: Sequence[str]

    @property
    def frames(self) -> list[str]:
        """Names of the frames that are asked."""
        return sorted({frame for regions in self.there.values() for frame in regions})

    @property
    def phrases(self) -> list[str]:
        return [*self.there, *self.absent]


@dataclass(frozen=True)
class Verdict:
    """score: the highest of the frames that were asked. inside: share of the lit pixels in the regions, and
    lit: share of the regions that are lit; None where the phrase names nothing that is there."""

    phrase: str
    verdict: str
    score: float
    inside: float | None = None
    lit: float | None = None


Shown = dict[tuple[str, str], tuple[np.ndarray, np.ndarray, np.ndarray]]
"""(phrase, frame) -> picture (H, W, 3) of bytes, mask (H, W), regions (H, W)."""


def read_place(path: Path) -> Place:
    """A place of its .json file.

    Raises:
        InputError: it cannot be read, or is none.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        place = Place(path.stem, document["there"], document["absent"])
        for regions in place.there.values():
            for region in (region for some in regions.values() for region in some):
                corners(region)
    except OSError:
        raise InputError(f"there is no file {path}; name the .json of a place") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(
            f'{path} is no place; write {{"there": {{phrase: {{frame: [region]}}}}, "absent": [phrase]}}'
        ) from None
    if not place.frames:
        raise InputError(f"{path} names no frame; give at least one region")
    return place


def corners(region: Region) -> np.ndarray:
    """Of a region, (n, 2) in shares of a frame's sides.

    Raises:
        ValueError: it has neither four sides nor corners.
    """
    given = np.asarray(region, dtype=np.float64)
    if given.shape == (4,):
        left, top, right, bottom = given
        return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])
    if given.ndim != 2 or given.shape[1] != 2 or len(given) < 3:
        raise ValueError("region: expected 4 numbers or 3 corners and more")
    return given


def painted(
    regions: Iterable[Region], photo: tuple[int, int], size: tuple[int, int]
) -> list[Bool[np.ndarray, "H W"]]:
    """Regions of a frame as masks of a view; without those that lie outside of it.

    Args:
        photo, size: (width, height) of the frame in its own pixels, and of the view: the frame's middle.
    """
    left, top, right, bottom = centre_box(*photo, size)
    masks = []
    for region in regions:
        places = corners(region) * photo - (left, top)
        pixels = np.round(places * size / (right - left, bottom - top)).astype(np.int32)
        mask = np.zeros(size[::-1], dtype=np.uint8)
        cv2.fillPoly(mask, [pixels], 1)
        masks.append(mask.astype(bool))
    return [mask for mask in masks if mask.any()]


def widened(mask: Bool[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """By `MARGIN`."""
    reach = round(MARGIN * max(mask.shape))
    kernel = np.ones((2 * reach + 1, 2 * reach + 1), dtype=np.uint8)
    return cv2.dilate(mask.astype(np.uint8), kernel).astype(bool)


def judged(
    phrase: str,
    masks: Sequence[Bool[np.ndarray, "H W"]],
    regions: Sequence[Sequence[Bool[np.ndarray, "H W"]]],
    score: float,
) -> Verdict:
    """What a phrase is worth that is there: a mask and the regions of each frame that shows it."""
    wide = [widened(np.logical_or.reduce(some)) for some in regions]
    lit = sum(int(mask.sum()) for mask in masks)
    found = [
        float(mask[region].mean()) >= LIT
        for mask, some in zip(masks, regions, strict=True)
        for region in some
    ]
    share = sum(found) / len(found)
    if not lit:
        return Verdict(phrase, MISSED, score, None, share)
    inside = sum(int((mask & own).sum()) for mask, own in zip(masks, wide, strict=True)) / lit
    if inside >= MOST and share >= 0.5:
        return Verdict(phrase, RIGHT, score, inside, share)
    return Verdict(phrase, PARTLY if inside >= SOME else WRONG, score, inside, share)


def judge_place(
    scene: Scene,
    place: Place,
    frames: Mapping[str, tuple[int, tuple[int, int]]],
    render: Render,
    progress: Progress = lambda stage, fraction: None,
    shown: Shown | None = None,
) -> list[Verdict]:
    """A verdict a phrase of a place; none of what only frames show that found no place in the scene.

    Args:
        frames: name -> its view in the scene, and (width, height) of the photo. shown: gets what was lit.

    Raises:
        InputError: none of the place's frames is in the scene.
    """
    asked = [name for name in place.frames if name in frames]
    if not asked:
        raise InputError(
            f"none of the frames {', '.join(place.frames)} found a place in the scene; take more photos"
        )
    results: dict[str, QueryResult] = {}
    for number, name in enumerate(asked):
        progress(name, number / len(asked))
        results[name] = query(scene, place.phrases, view=frames[name][0], render=render)
    shown = {} if shown is None else shown
    found = (_verdict(place, row, phrase, results, frames, shown) for row, phrase in enumerate(place.phrases))
    return [one for one in found if one is not None]


def _verdict(
    place: Place,
    row: int,
    phrase: str,
    results: Mapping[str, QueryResult],
    frames: Mapping[str, tuple[int, tuple[int, int]]],
    shown: Shown,
) -> Verdict | None:
    regions: dict[str, list] = {}
    for name, result in results.items():
        mask = result.masks[row].cpu().numpy()
        own = painted(place.there.get(phrase, {}).get(name, ()), frames[name][1], mask.shape[::-1])
        if own or phrase not in place.there:
            regions[name] = own
            lines = np.logical_or.reduce([*own, np.zeros_like(mask)])
            shown[phrase, name] = (_bytes(result.frame.rgb), mask, lines)
    masks = [results[name].masks[row].cpu().numpy() for name in regions]
    score = max((results[name].answers[row].score for name in regions), default=0.0)
    if phrase in place.there:
        return judged(phrase, masks, list(regions.values()), score) if regions else None
    return Verdict(phrase, CLAIMED if any(mask.any() for mask in masks) else HONEST, score)


def _bytes(rgb: Tensor) -> np.ndarray:
    return (rgb.cpu().clamp(0, 1) * 255).round().byte().numpy()


def shares(verdicts: Sequence[Verdict]) -> dict[str, float]:
    """Of the phrases that are there and of those that are not, how many got which verdict; "confident": of
    all, how many were wrong or claimed with a score above `SURE`."""
    found: dict[str, float] = {}
    for kinds in (THERE, ABSENT):
        some = [one.verdict for one in verdicts if one.verdict in kinds]
        found |= {kind: some.count(kind) / len(some) for kind in kinds if some}
    bad = [one for one in verdicts if one.verdict in (WRONG, CLAIMED) and one.score > SURE]
    return {**found, "confident": len(bad) / max(len(verdicts), 1)}


def phrases_markdown(name: str, verdicts: Sequence[Verdict]) -> str:
    """Shares, and which phrases got which verdict."""
    counted = shares(verdicts)
    lines = [f"| {name}, {len(verdicts)} phrases | share | phrases |", "|---|---|---|"]
    for kind in (kind for kind in (*THERE, *ABSENT) if kind in counted):
        some = [one for one in verdicts if one.verdict == kind]
        said = ", ".join(f"{one.phrase} ({one.score:.2f})" for one in some)
        lines.append(f"| {kind} | {100 * counted[kind]:.0f} % | {said} |")
    lines.append(f"| wrong above {SURE} | {100 * counted['confident']:.0f} % | |")
    return "\n".join(lines) + "\n"
