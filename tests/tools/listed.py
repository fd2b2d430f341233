"""The inventory of three real rooms, beside what a person sees standing there.

    python -m tests.tools.listed kitchen=SCENE workshop=SCENE office=SCENE

SCENE is a `.langflash` of frames named as below; things are judged that these frames show. A thing of the
list is right where its name is true of what stands at one of its points, and not also of something else that
it covers: two chairs are not one. Each that stands there counts once.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from langflash_core.inventory import Inventory, Thing, inventory
from langflash_core.inventory.plan import Plan, floor_plan, goes_through
from langflash_core.inventory.settings import LISTING
from langflash_core.scene.file import load

Points = Mapping[str, Sequence[float]]
"""Frame -> x, y, x, y and so on of points on a thing, in shares of the frame's sides."""
NEAR = 0.012
"""Of a photo's longer side, around a point: hands err by so much, small things are thrice as wide."""
ROOMS: dict[str, list[tuple[str, Points]]] = json.loads(Path(__file__).with_suffix(".json").read_text())
"""Of each room what stands there: names that are true of it, and where photos show it."""


@dataclass(frozen=True)
class Verdict:
    """right: title of a listed thing -> the number of what stands there. nonsense: titles. true: how many
    stand there that the scene's photos show."""

    right: dict[str, int]
    nonsense: tuple[str, ...]
    listed: int
    true: int

    def __str__(self) -> str:
        precision = f"{len(self.right) / self.listed:.2f}" if self.listed else "-"
        return (
            f"{self.listed} listed, {self.true} there: precision {precision}, "
            f"recall {len(self.right) / self.true:.2f}, nonsense {len(self.nonsense)}"
        )


def covered(found: Inventory, points: Points) -> set[int]:
    """Places in `things` of what a room's photos show at points."""
    scene, shown = found.given, set()
    names = [Path(name).stem for name in scene.record.photos]
    frame_size = scene.record.detail["photo_size"]
    means = scene.gaussians.means.double().numpy()
    views = np.zeros(len(means), int) if scene.view_ids is None else scene.view_ids.numpy()
    for frame, places in points.items():
        if frame not in names:
            continue
        view = names.index(frame)
        own = np.flatnonzero(views == view)
        camera = scene.camera(view)
        viewmat, K = camera.viewmat.double().numpy(), camera.K.double().numpy()
        pos_c = means[own] @ viewmat[:3, :3].T + viewmat[:3, 3]
        pixels = (pos_c / pos_c[:, 2:]) @ K[:2].T
        for place in np.array(places).reshape(-1, 2):
            at = _in_view(place, frame_size, (camera.width, camera.height))
            near = np.hypot(*(pixels - at).T) <= NEAR * max(camera.width, camera.height)
            numbers = found.numbers[own[near]]
            if len(numbers):
                shown.add(int(np.bincount(numbers + 1).argmax()) - 1)
    return shown - {-1}


def _in_view(place: np.ndarray, photo: list[int], view: tuple[int, int]) -> np.ndarray:
    """Pixels in a view, the middle of its photo (width, height)."""
    scale = max(view[0] / photo[0], view[1] / photo[1])
    return (place - 0.5) * np.array(photo) * scale + np.array(view) / 2


def judge(found: Inventory, room: Sequence[tuple[str, Points]]) -> Verdict:
    """A list beside what stands there: right things, and those that cannot be."""
    frames = {Path(name).stem for name in found.given.record.photos}
    there = [(names.split(", "), points) for names, points in room if frames & set(points)]
    at = [covered(found, points) for _, points in there]
    right: dict[str, int] = {}
    for number, thing in enumerate(found.things):
        own = [place for place, shown in enumerate(at) if number in shown and thing.kind in there[place][0]]
        if len(own) == 1 and own[0] not in right.values():
            right[thing.id] = own[0]
    plan = floor_plan(found)
    senseless = tuple(thing.id for thing in found.things if nonsense(found, plan, thing))
    return Verdict(right, senseless, len(found.things), len(there))


def nonsense(found: Inventory, plan: Plan, thing: Thing) -> bool:
    """Whether a thing is under 5 cm, over the room, or goes through a wall of the plan."""
    if sorted(thing.size)[1] < LISTING.least_size * found.metre or thing.bottom > found.top:
        return True
    openings = [opening.thing for opening in plan.openings]
    return thing not in openings and any(goes_through(thing, wall, found.metre) for wall in plan.walls)


def main() -> None:
    for word in sys.argv[1:]:
        name, _, path = word.partition("=")
        found = inventory(load(Path(path)))
        verdict = judge(found, ROOMS[name])
        sys.stdout.write(f"{name}: {verdict}, {len(floor_plan(found).walls)} walls\n")
        for thing in found.things:
            size = " x ".join(f"{side:.2f}" for side in thing.size)
            told = ROOMS[name][verdict.right[thing.id]][0] if thing.id in verdict.right else "WRONG"
            sys.stdout.write(f"  {thing.id}, {size}: {told}{' NONSENSE' * (thing.id in verdict.nonsense)}\n")


if __name__ == "__main__":
    main()
