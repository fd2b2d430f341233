"""Any number of short clips: a window that moves along one of the shipped photos, frame by frame.

python -m tests.batch.moving_clips FOLDER 8
"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from tests.batch.photo_sets import ASSETS, PAIRS, SIZE

FRAMES = 4
STEP = 12  # pixels of a frame


def make_clips(folder: Path, count: int, seed: int = 0) -> list[Path]:
    """Write `count` sub-folders of JPEGs, 000.jpg and on; the same seed gives the same bytes."""
    draw = np.random.default_rng(seed)
    width, height = SIZE[0] + STEP * (FRAMES - 1), SIZE[1]
    places = []
    for number in range(count):
        photo = Image.open(next(ASSETS.glob(f"{PAIRS[number % len(PAIRS)]}_left.*"))).convert("RGB")
        scale = draw.uniform(0.7, 1.0) * min(photo.width / width, photo.height / height)
        left, top = (
            draw.uniform(0, photo.width - scale * width),
            draw.uniform(0, photo.height - scale * height),
        )
        strip = photo.resize(
            (width, height),
            Image.Resampling.BILINEAR,
            box=(left, top, left + scale * width, top + scale * height),
        )
        place = folder / f"clip{number:03}"
        place.mkdir(parents=True)
        for frame in range(FRAMES):
            moved = strip.crop((STEP * frame, 0, STEP * frame + SIZE[0], height))
            moved.save(place / f"{frame:03}.jpg", quality=90)
        places.append(place)
    return places


if __name__ == "__main__":
    make_clips(Path(sys.argv[1]), int(sys.argv[2]))
