"""What one click selects of things that were outlined by hand in frames of two real films, as drawn there.

    python -m tests.tools.clicks FILMS

FILMS holds the frames: vrnerf_kitchen/0008.png and so on. A scene is made of each frame below and the ones
before and after it; every thing is clicked where it is widest, and what is drawn of the selection in that
frame is compared with the outline: intersection over union, and the best that its other levels give.
"""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
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

Shape = Sequence[int]
"""x, y of corners; x, y of a middle and two radii; pixels of the frame."""
Select = Callable[[np.ndarray], list[np.ndarray]]
"""Of what a click shows (N,) bool: what it selects, then its other levels."""
RADIUS = 4  # pixels around a click, as in the window

FRAMES: dict[str, dict[str, Shape]] = json.loads(Path(__file__).with_suffix(".json").read_text())
"""By film and frame, outlines of things."""


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
    for place, shapes in FRAMES.items():
        film, number = place.split("/")
        files = [films / film / f"{int(number) + step:04d}.png" for step in (-1, 0, 1)]
        with Image.open(files[1]) as opened:
            frame = opened.size
        for name, values in judged(reconstruct(files), shapes, frame).items():
            tell(f"{film} {int(number)} {name}: {values[0]:.2f} ({values[1]:.2f})\n")
            told.append(values)
    chosen, best = np.array(told).T
    tell(f"{len(told)} things: IoU {chosen.mean():.3f}, over .5 {(chosen > 0.5).mean():.3f}; ")
    tell(f"best level {best.mean():.3f}, {(best > 0.5).mean():.3f}\n")


if __name__ == "__main__":
    main()
