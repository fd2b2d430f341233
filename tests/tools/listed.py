"""The inventory of three real rooms, beside what a person sees standing there.

    python -m tests.tools.listed kitchen=SCENE workshop=SCENE office=SCENE

SCENE is a `.langflash` of frames named as below; things are judged that these frames show. A thing of the
list is right where its name is true of what stands at one of its points, and not also of something else that
it covers: two chairs are not one. Each that stands there counts once.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from langflash_core.inventory import Inventory, Thing, inventory
from langflash_core.inventory.plan import Plan, floor_plan, goes_through
from langflash_core.inventory.settings import LISTING
from langflash_core.scene.file import load

Points = Mapping[str, tuple[float, ...]]
"""Frame -> x, y, x, y and so on of points on a thing, in shares of the frame's sides."""
COUNTER, FRUIT, CHEST = (
    "kitchen island, cabinet",
    "food, basket, bowl",
    "dresser, cabinet, desk, table, kitchen island",
)
NEAR = (
    0.012  # of a photo's longer side, around a point: hands err by so much, small things are thrice as wide
)

ROOMS: dict[str, tuple[tuple[str, Points], ...]] = {
    "kitchen": (
        ("water cooler", {"0002": (0.505, 0.53), "0008": (0.255, 0.54)}),
        ("cabinet, kitchen island, desk, table", {"0002": (0.565, 0.575, 0.74, 0.575)}),
        (COUNTER, {"0002": (0.9, 0.6), "0008": (0.5, 0.9, 0.85, 0.56), "0016": (0.2, 0.7, 0.15, 0.56)}),
        (COUNTER, {"0016": (0.7, 0.7, 0.75, 0.615)}),
        ("microwave, stove", {"0008": (0.62, 0.69)}),
        ("plant, vase", {"0008": (0.63, 0.49, 0.645, 0.54)}),
        ("plant, vase", {"0016": (0.44, 0.485, 0.44, 0.525)}),
        ("lamp", {"0008": (0.51, 0.285)}),
        ("lamp", {"0008": (0.71, 0.345)}),
        ("lamp", {"0008": (0.425, 0.315)}),
        ("lamp", {"0008": (0.87, 0.325)}),
        ("lamp", {"0016": (0.75, 0.337)}),
        ("lamp", {"0016": (0.81, 0.33)}),
        ("lamp", {"0016": (0.89, 0.37)}),
        ("lamp", {"0002": (0.75, 0.357)}),
        ("lamp", {"0002": (0.1, 0.295)}),
        ("coffee machine, kitchen appliance", {"0002": (0.82, 0.5)}),
        ("coffee machine, kitchen appliance", {"0002": (0.575, 0.5), "0008": (0.35, 0.51)}),
        ("refrigerator", {"0016": (0.77, 0.5)}),
        ("bookcase, cabinet", {"0016": (0.92, 0.5)}),
        ("sink", {"0008": (0.83, 0.515)}),
        ("cabinet, box, desk", {"0002": (0.42, 0.56)}),
    ),
    "workshop": (
        (CHEST, {"0004": (0.2, 0.8, 0.2, 0.66), "0022": (0.39, 0.63)}),
        (CHEST, {"0004": (0.9, 0.72), "0022": (0.66, 0.6)}),
        ("box", {"0004": (0.25, 0.57)}),
        ("picture, calendar, newspaper, whiteboard", {"0004": (0.35, 0.5)}),
        ("ladder", {"0004": (0.475, 0.5), "0014": (0.26, 0.5)}),
        ("ladder", {"0014": (0.925, 0.75)}),
        ("lamp", {"0004": (0.55, 0.292)}),
        ("lamp", {"0004": (0.55, 0.385), "0014": (0.34, 0.15)}),
        ("lamp", {"0022": (0.5, 0.34)}),
        ("lamp", {"0028": (0.7, 0.277)}),
        ("box", {"0014": (0.36, 0.7), "0004": (0.525, 0.6)}),
        ("picture, whiteboard", {"0014": (0.61, 0.66), "0004": (0.64, 0.585)}),
        ("cabinet, safe", {"0014": (0.13, 0.6)}),
        ("cabinet, safe", {"0014": (0.02, 0.65)}),
        ("tool, fitness machine", {"0028": (0.3, 0.6)}),
        ("tool, fitness machine", {"0028": (0.86, 0.65)}),
        ("tool, fitness machine, table", {"0022": (0.2, 0.75, 0.22, 0.67)}),
        ("box", {"0022": (0.78, 0.7), "0028": (0.7, 0.63)}),
        ("picture, whiteboard, window", {"0028": (0.95, 0.5)}),
        ("box, basket", {"0028": (0.1, 0.65)}),
        ("cabinet, desk, table, dresser", {"0028": (0.15, 0.93)}),
        ("trash bin, fire extinguisher, barrel", {"0022": (0.355, 0.665)}),
    ),
    "office": (
        ("chair", {"0072": (0.5, 0.5), "0078": (0.42, 0.75)}),
        ("chair", {"0072": (0.8, 0.8), "0078": (0.8, 0.92)}),
        ("chair", {"0096": (0.47, 0.87), "0084": (0.4, 0.95)}),
        ("chair", {"0090": (0.38, 0.75), "0084": (0.75, 0.75)}),
        ("chair", {"0090": (0.7, 0.6)}),
        ("chair", {"0090": (0.87, 0.46)}),
        ("chair", {"0096": (0.5, 0.29), "0090": (0.17, 0.27)}),
        ("chair", {"0096": (0.67, 0.21), "0090": (0.36, 0.18)}),
        ("table, desk", {"0072": (0.58, 0.37), "0078": (0.6, 0.62), "0084": (0.6, 0.5), "0090": (0.5, 0.57),
                         "0096": (0.55, 0.68)}),
        ("table, coffee table", {"0090": (0.1, 0.08), "0096": (0.81, 0.13), "0084": (0.5, 0.06)}),
        ("sofa, armchair", {"0090": (0.7, 0.09), "0084": (0.92, 0.02)}),
        ("plant", {"0072": (0.92, 0.04), "0078": (0.7, 0.04), "0096": (0.17, 0.1)}),
        ("plant", {"0096": (0.36, 0.2), "0084": (0.03, 0.2)}),
        ("radiator", {"0072": (0.55, 0.15), "0078": (0.43, 0.33)}),
        ("radiator", {"0072": (0.05, 0.5)}),
        ("window", {"0072": (0.04, 0.12)}),
        ("window", {"0072": (0.48, 0.03), "0078": (0.27, 0.06)}),
        ("box, basket, bag, suitcase", {"0072": (0.7, 0.3), "0078": (0.7, 0.5), "0096": (0.25, 0.57)}),
        ("box, basket", {"0078": (0.22, 0.5), "0072": (0.45, 0.41)}),
        (FRUIT, {"0096": (0.6, 0.5), "0084": (0.37, 0.48)}),
        (FRUIT, {"0090": (0.46, 0.38), "0084": (0.8, 0.33)}),
        ("cup, bottle, jar, candle", {"0090": (0.86, 0.24)}),
        ("book, newspaper, picture", {"0096": (0.85, 0.56), "0090": (0.27, 0.46), "0084": (0.6, 0.42)}),
    ),
}  # fmt: skip
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


def judge(found: Inventory, room: tuple[tuple[str, Points], ...]) -> Verdict:
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
