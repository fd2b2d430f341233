"""What one click selects of things that were outlined by hand in frames of two real films, as drawn there.

    python -m tests.tools.clicks FILMS

FILMS holds the frames: vrnerf_kitchen/0008.png and so on. A scene is made of each frame below and the ones
before and after it; every thing is clicked where it is widest, and what is drawn of the selection in that
frame is compared with the outline: intersection over union, and the best that its other levels give.
"""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import torch
from PIL import Image

from langflash_core.mending.looks import draw_scene, mattes
from langflash_core.pipeline import reconstruct
from langflash_core.scene.regions import regions_of
from langflash_core.splat.outlines import silhouette
from langflash_core.splat.picking import seen_in
from langflash_core.types import Scene

Shape = tuple[int, ...]
"""x, y of corners; x, y of a middle and two radii; pixels of the frame."""
Select = Callable[[np.ndarray], list[np.ndarray]]
"""Of what a click shows (N,) bool: what it selects, then its other levels."""
RADIUS = 4  # pixels around a click, as in the window

FRAMES: dict[tuple[str, int], dict[str, Shape]] = {
    ("vrnerf_kitchen", 8): {
        "plant": (380, 523, 392, 509, 406, 486, 443, 472, 472, 495, 483, 506, 473, 532, 459, 572, 423, 571,
                  413, 537, 392, 532),
        "microwave": (335, 637, 494, 637, 552, 675, 551, 786, 347, 800, 341, 688),
        "doors": (248, 818, 641, 810, 641, 1000, 276, 1006, 276, 906, 248, 905),
        "water machine": (145, 479, 200, 478, 220, 486, 219, 546, 209, 624, 150, 624, 142, 486),
        "dispenser": (459, 466, 511, 463, 511, 543, 470, 545, 478, 505),
        "grey lamp": (349, 290, 27, 30),
        "copper lamp": (486, 355, 27, 26),
        "sockets": (248, 906, 276, 906, 276, 1024, 248, 1024),
        "spot": (281, 304, 299, 304, 299, 345, 281, 345),
        "top": (223, 618, 287, 550, 409, 549, 418, 572, 463, 572, 472, 549, 684, 546, 684, 617),
        "oven": (219, 491, 250, 491, 250, 546, 219, 546),
    },
    ("vrnerf_kitchen", 11): {
        "plant": (141, 514, 149, 486, 182, 472, 196, 495, 210, 486, 240, 506, 220, 523, 222, 537, 213, 563,
                  170, 563, 166, 537, 149, 534),
        "microwave": (0, 651, 190, 648, 192, 743, 3, 747, 0, 747),
        "colour chart": (402, 514, 472, 516, 472, 561, 402, 557),
        "long doors": (261, 610, 684, 603, 684, 887, 268, 907),
        "doors": (0, 759, 243, 757, 244, 909, 0, 919),
        "copper lamp": (288, 367, 23, 23),
        "left lamp": (74, 319, 29, 25),
        "right lamp": (475, 327, 24, 24),
        "far copper lamp": (596, 300, 27, 25),
        "espresso machine": (289, 489, 357, 489, 357, 540, 289, 540),
        "dispenser": (368, 463, 401, 463, 401, 543, 368, 543),
    },
    ("vrnerf_workshop", 12): {
        "cabinet": (160, 480, 220, 494, 220, 767, 159, 839),
        "far cabinet": (225, 497, 256, 501, 256, 667, 225, 693),
        "blue machine": (215, 874, 249, 877, 249, 939, 206, 1059, 145, 1059, 148, 1003, 200, 918),
        "stools": (308, 588, 375, 585, 378, 755, 366, 770, 321, 770, 308, 739),
        "sign": (453, 643, 507, 646, 510, 755, 509, 821, 484, 839, 457, 820, 455, 755),
        "ladder": (271, 374, 299, 392, 313, 755, 295, 756),
        "press": (639, 591, 654, 573, 660, 503, 678, 503, 678, 591, 711, 555, 746, 591, 746, 1057, 590, 1057,
                  590, 954, 657, 948, 654, 773, 624, 752, 642, 736, 705, 736, 702, 658, 639, 652, 618, 615),
        "drawers": (0, 745, 48, 730, 47, 1045, 0, 1057),
    },
    ("vrnerf_workshop", 22): {
        "cardboard": (569, 591, 669, 620, 624, 773, 587, 882, 554, 882, 506, 773),
        "sander": (82, 755, 136, 709, 151, 682, 194, 688, 248, 706, 242, 858, 194, 951, 118, 951, 117, 764),
        "danger sign": (59, 594, 115, 586, 115, 626, 59, 647),
        "red bin": (249, 683, 277, 683, 276, 739, 248, 741),
        "drawers": (255, 608, 285, 606, 326, 579, 326, 646, 285, 718, 262, 718),
        "vacuum": (0, 888, 112, 888, 127, 942, 94, 1057, 0, 1059),
        "duct": (174, 150, 204, 84, 746, 45, 746, 207, 287, 228, 308, 299, 287, 344, 251, 344, 192, 237),
        "long lamp": (190, 347, 539, 347, 539, 365, 190, 365),
    },
}  # fmt: skip


def by_regions(scene: Scene) -> Select:
    """As the window selects."""
    regions = regions_of(scene)

    def select(seen: np.ndarray) -> list[np.ndarray]:
        reach = regions.around(seen)
        if reach is None:
            return [seen]
        levels = sorted(range(reach.count), key=lambda level: level != reach.chosen)
        return [reach.rows(level) for level in levels]

    return select


def mask_of(shape: Shape, frame: tuple[int, int], size: tuple[int, int]) -> np.ndarray:
    """(height, width) bool of a shape in a photo of `size` (w, h), the middle of the frame (w, h)."""
    scale = max(size[0] / frame[0], size[1] / frame[1])
    aside = np.array([(frame[0] * scale - size[0]) / 2, (frame[1] * scale - size[1]) / 2])
    mask = np.zeros((size[1], size[0]), np.uint8)
    if len(shape) == 4:
        middle, radii = (np.array(shape[:2]) * scale - aside), np.array(shape[2:]) * scale
        cv2.ellipse(mask, middle.astype(int).tolist(), radii.astype(int).tolist(), 0, 0, 360, 1, -1)
    else:
        corners = np.array(shape).reshape(-1, 2) * scale - aside
        cv2.fillPoly(mask, [corners.astype(np.int32)], 1)
    return mask > 0


def judged(
    scene: Scene,
    shapes: dict[str, Shape],
    frame: tuple[int, int],
    chooser: Callable[[Scene], Select] = by_regions,
    view: int = 1,
) -> dict[str, tuple[float, float]]:
    """Of each thing: the overlap of what a click selects, as drawn, and the best of all levels, by their
    silhouettes."""
    size = tuple(scene.record.detail["photo_size"])
    camera, every, select = scene.camera(view, *size), np.ones(len(scene.gaussians), bool), chooser(scene)
    half, found = (size[0] // 2, size[1] // 2), {}
    for name, shape in shapes.items():
        inside = np.pad(mask_of(shape, frame, size), 1).astype(np.uint8)
        deep = cv2.distanceTransform(inside, cv2.DIST_L2, 3)[1:-1, 1:-1]
        lines, columns = np.indices(deep.shape)
        line, column = np.unravel_index(deep.argmax(), deep.shape)
        pixels = np.asarray(np.hypot(lines - line, columns - column) <= RADIUS)
        chosen, *others = select(seen_in(scene, every, camera, pixels))
        true, seen = mask_of(shape, frame, half), camera.with_size(*half)
        matte = mattes(scene, torch.from_numpy(chosen), [seen], draw_scene)[0][0].numpy() > 0.5
        own = overlap(matte, true)
        found[name] = (
            own,
            max([own, *(overlap(silhouette(scene, every, each, seen), true) for each in others)]),
        )
    return found


def overlap(one: np.ndarray, other: np.ndarray) -> float:
    """Intersection over union."""
    return float((one & other).sum() / max((one | other).sum(), 1))


def main() -> None:
    tell = sys.stdout.write
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("films", type=Path)
    told: list[tuple[float, float]] = []
    films = parser.parse_args().films
    for (film, number), shapes in FRAMES.items():
        files = [films / film / f"{each:04d}.png" for each in (number - 1, number, number + 1)]
        with Image.open(files[1]) as opened:
            frame = opened.size
        for name, values in judged(reconstruct(files), shapes, frame).items():
            tell(f"{film} {number} {name}: {values[0]:.2f} ({values[1]:.2f})\n")
            told.append(values)
    chosen, best = np.array(told).T
    tell(f"{len(told)} things: IoU {chosen.mean():.3f}, over .5 {(chosen > 0.5).mean():.3f}; ")
    tell(f"best level {best.mean():.3f}, {(best > 0.5).mean():.3f}\n")


if __name__ == "__main__":
    main()
