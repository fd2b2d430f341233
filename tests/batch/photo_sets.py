"""Any number of small photo sets: windows of the shipped stereo photos, the same in both pictures of a pair.

python -m tests.batch.photo_sets FOLDER 1000
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

ASSETS = Path(__file__).resolve().parents[2] / "assets" / "photos"
PAIRS = ("aloe", "books", "desk", "living_room", "toy")
SIZE = (320, 240)  # pixels of a picture


def make_sets(folder: Path, count: int, seed: int = 0) -> list[Path]:
    """Write `count` sub-folders of two JPEGs each; the same seed gives the same bytes.

    Windows cover 70 to 100 % of what fits into the photo, so that every set still shows things and matches.
    """
    draw, pairs = np.random.default_rng(seed), [_pair(name) for name in PAIRS]
    folders = []
    for number in range(count):
        pair = pairs[number % len(pairs)]
        box = _window(pair[0].size, draw)
        place = folder / f"set{number:04}"
        place.mkdir(parents=True)
        for side, photo in zip(("left", "right"), pair, strict=True):
            small = photo.resize(SIZE, Image.Resampling.BILINEAR, box=box)
            small.save(place / f"{side}.jpg", quality=90)
        folders.append(place)
    return folders


def _pair(name: str) -> tuple[Image.Image, Image.Image]:
    left, right = (next(ASSETS.glob(f"{name}_{side}.*")) for side in ("left", "right"))
    return Image.open(left).convert("RGB"), Image.open(right).convert("RGB")


def _window(size: tuple[int, int], draw: np.random.Generator) -> tuple[float, float, float, float]:
    """Left, top, right, bottom in pixels, of the shape of SIZE."""
    largest = min(size[0] / SIZE[0], size[1] / SIZE[1])
    scale = largest * draw.uniform(0.7, 1.0)
    width, height = scale * SIZE[0], scale * SIZE[1]
    left, top = draw.uniform(0, size[0] - width), draw.uniform(0, size[1] - height)
    return left, top, left + width, top + height


if __name__ == "__main__":
    make_sets(Path(sys.argv[1]), int(sys.argv[2]))
