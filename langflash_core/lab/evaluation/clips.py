"""How good collected labels are where the truth is known: clips of rendered rooms, and the measures.

T frames, H W pixels. *Things* are what stands in a room; walls, floor and ceiling are judged apart, since a
proposer may rightly take every wall for itself.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, UInt16
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.storage import ClipLabels
from langflash_core.lab.rooms import Pack, RoomRenderer, StagedRoom, staged_room
from langflash_core.lab.rooms.cameras import stands_free
from langflash_core.lab.rooms.catalogue import HELD_OUT_LIBRARIES
from langflash_core.lab.rooms.sensor import expose

FRAMES, SIZE = 24, (288, 384)
STRUCTURE = 3
"""Wall, floor and ceiling are the first instances of a room."""
SHOWS = 0.01
"""Share of a frame from which a true thing has to be found there."""
LATE = 5
"""Frames after which a thing that was not in sight counts as entering late."""
_BEYOND = 0.35  # of the way between a room's two cameras, that the path goes on at both ends
_LEAST_FRAMES = 6
_FOUND = 0.5


@dataclass(frozen=True)
class TrueClip:
    """A rendered clip with ids (T, H, W), 0 nothing, 1 to 3 the structure; names of all ids."""

    clip: Clip
    ids: UInt16[np.ndarray, "T H W"]
    names: tuple[str, ...]

    def shares(self, id: int) -> Float[np.ndarray, " T"]:
        """Of each frame, that it fills."""
        return (self.ids == id).mean((1, 2))

    @property
    def things(self) -> tuple[int, ...]:
        """Ids of what shows well enough, long enough."""
        every = (int(id) for id in np.unique(self.ids) if id > STRUCTURE)
        return tuple(id for id in every if (self.shares(id) >= SHOWS).sum() >= _LEAST_FRAMES)

    @property
    def late(self) -> tuple[int, ...]:
        """Those of the things that are not in sight at first."""
        return tuple(id for id in self.things if not (self.ids[:LATE] == id).any())


@dataclass(frozen=True)
class ThingScore:
    """One true thing. iou: mean over the frames where it shows, of the one id that fits it best; constant:
    share of those frames in which that id is also the best of the frame; delay: frames from its first showing
    until that id is on it, None for never."""

    id: int
    name: str
    iou: float
    constant: float
    delay: int | None
    late: bool

    @property
    def found(self) -> bool:
        return self.iou >= _FOUND


def rendered_clip(
    seed: int, pack: Pack, renderer: RoomRenderer, size: tuple[int, int] = SIZE, frames: int = FRAMES
) -> TrueClip | None:
    """A camera's way through a room of held-out furniture, along and beyond the line between two views.

    Args:
        size: (height, width).

    Returns:
        None where the camera would run into something.
    """
    staged = staged_room(seed, pack, renderer, size=size, libraries=HELD_OUT_LIBRARIES)
    viewmats = np.stack(list(_path(staged, frames)))
    full = viewmats @ staged.home
    eyes = [-view[:3, :3].T @ view[:3, 3] for view in full]
    if not all(stands_free(staged.room, eye) for eye in eyes):
        return None
    K = staged.views.Ks[0].astype(np.float64)
    pictures = [renderer.draw(view, K, size) for view in full]
    sensor, rng = replace(staged.sensor, vignette=0.0, blur=0.0), np.random.default_rng(seed)
    images = [expose(picture.radiance, sensor, rng, staged.grey) for picture in pictures]
    ids = np.stack([picture.ids for picture in pictures]).astype(np.uint16)
    names = ("", *(instance.names[0] for instance in staged.room.instances))
    clip = Clip(
        f"room {seed}",
        tuple(f"{t:04d}" for t in range(frames)),
        images.__getitem__,
        torch.from_numpy(np.repeat(K[None], frames, 0)).float(),
        torch.from_numpy(viewmats).float(),
    )
    return TrueClip(clip, ids, names)


def _path(staged: StagedRoom, frames: int) -> Iterator[Float[np.ndarray, "4 4"]]:
    """World of the sample to cameras."""
    last = staged.views.viewmats[1].astype(np.float64)
    turn = Rotation.from_matrix(last[:3, :3]).as_rotvec()
    eye = -last[:3, :3].T @ last[:3, 3]
    for share in np.linspace(-_BEYOND, 1 + _BEYOND, frames):
        view = np.eye(4)
        view[:3, :3] = Rotation.from_rotvec(share * turn).as_matrix()
        view[:3, 3] = -view[:3, :3] @ (share * eye)
        yield view


def judged(truth: TrueClip, ids: UInt16[np.ndarray, "T H W"]) -> list[ThingScore]:
    """Every true thing against the ids that were collected; no id may stand for two things."""
    ids = np.where(truth.ids > 0, ids, 0)  # what shows through a window is no part of the room
    things, numbers = truth.things, np.unique(ids[ids > 0])
    shows = [truth.shares(id) >= SHOWS for id in things]
    ious = np.zeros((len(things), max(len(numbers), len(things)), len(ids)))  # where ids lack, none: 0
    for n, number in enumerate(numbers):
        own = ids == number
        for t, id in enumerate(things):
            true = truth.ids == id
            ious[t, n] = (own & true).sum((1, 2)) / np.maximum((own | true).sum((1, 2)), 1)
    means = np.stack([ious[t][:, s].mean(1) for t, s in enumerate(shows)]) if things else np.zeros((0, 1))
    _, chosen = linear_sum_assignment(-means)  # one for every thing, in their order
    return [_score(truth, id, shows[t], ious[t], int(chosen[t])) for t, id in enumerate(things)]


def _score(truth: TrueClip, id: int, shows: np.ndarray, ious: np.ndarray, best: int) -> ThingScore:
    """Of one thing: ious (N, T) with every collected id, of which `best` stands for it."""
    caught = np.flatnonzero(ious[best] >= _FOUND)
    return ThingScore(
        id=id,
        name=truth.names[id],
        iou=float(ious[best, shows].mean()),
        constant=float((ious[:, shows].argmax(0) == best).mean()),
        delay=max(0, int(caught[0] - np.flatnonzero(shows)[0])) if len(caught) else None,
        late=id in truth.late,
    )


def clips_result(judgements: Sequence[tuple[ClipLabels, Sequence[ThingScore]]]) -> dict:
    """Numbers of clips, as plain JSON values; `iou` of a clip is the mean over its things, null where it has
    none; `constant` the mean over those that were found."""
    clips = []
    for labels, scores in judgements:
        clips.append(
            {
                "clip": labels.name,
                "things": len(scores),
                "found": sum(score.found for score in scores),
                "late": sum(score.late for score in scores),
                "late_found": sum(score.late and score.found for score in scores),
                "iou": _mean([score.iou for score in scores]),
                "constant": _mean([score.constant for score in scores if score.found]),
                "objects": len(labels.objects),
                "coverage": float(labels.coverage.mean()),
                "frames_per_second": len(labels.frames) / max(labels.seconds["total"], 1e-9),
                "seconds": labels.seconds,
                "scores": [asdict(score) for score in scores],
            }
        )
    return {"clips": clips, "iou": _mean([clip["iou"] for clip in clips if clip["iou"] is not None])}


def _mean(values: Sequence[float]) -> float | None:
    """None: there is nothing to take it of."""
    return float(np.mean(values)) if len(values) else None


def _told(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def clips_markdown(result: dict) -> str:
    """A row a clip, then a row a thing."""
    lines = [
        "| clip | things found | of those late | mean IoU | ids constant | objects | covered | frames/s |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for clip in result["clips"]:
        cells = (
            clip["clip"],
            f"{clip['found']} of {clip['things']}",
            f"{clip['late_found']} of {clip['late']}",
            _told(clip["iou"], ".3f"),
            _told(clip["constant"], ".0%"),
            str(clip["objects"]),
            f"{clip['coverage']:.0%}",
            f"{clip['frames_per_second']:.2f}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "| clip | thing | IoU | id constant | caught after |", "|---|---|---|---|---|"]
    for clip in result["clips"]:
        for score in clip["scores"]:
            caught = "never" if score["delay"] is None else f"{score['delay']} frames"
            late = ", comes in late" if score["late"] else ""
            lines.append(
                f"| {clip['clip']} | {score['name']}{late} | {score['iou']:.2f} | {score['constant']:.0%} | "
                f"{caught} |"
            )
    return "\n".join(lines) + "\n"
