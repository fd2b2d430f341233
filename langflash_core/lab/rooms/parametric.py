"""Furniture drawn by recipes: endless makes of the things that homes are full of. Metres, y up, front +z.

The catalogues hold a handful of models of each class, and a network that has seen four wardrobes
knows four wardrobes. Each recipe draws sizes, proportions, parts and materials anew from a generator,
within what people sell. One library to train on, and one of other makes to validate on; what a
checkpoint is judged by at the end comes from neither.
"""

import io
import json
import zlib
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image

from langflash_core.lab.rooms.catalogue import PARAMETRIC, UNSEEN, Item
from langflash_core.lab.rooms.design import NUM_WOODS, Design, Draw, Look
from langflash_core.lab.rooms.objfile import Soup, smooth_normals
from langflash_core.lab.rooms.recipes import drawn
from langflash_core.lab.rooms.solids import Triangles

_TEXTURE_SIDE = 128
_TILES_PER_M = 1.3
_STRETCH = 0.04  # less than one sees on what is round
_FIRST_UNSEEN = 1000  # copies are counted from here; of no recipe are as many made
_WOOD_TONES = (
    ((0.62, 0.45, 0.28), (0.78, 0.62, 0.43)),
    ((0.30, 0.19, 0.11), (0.45, 0.30, 0.19)),
    ((0.74, 0.60, 0.42), (0.88, 0.76, 0.58)),
    ((0.45, 0.24, 0.13), (0.62, 0.38, 0.22)),
    ((0.20, 0.14, 0.10), (0.31, 0.22, 0.16)),
    ((0.66, 0.60, 0.53), (0.80, 0.75, 0.68)),
)

PIECES: dict[str, int] = json.loads(
    (Path(__file__).resolve().parent / "tables" / "made.json").read_text(encoding="utf-8")
)
"""Recipes of `furniture/*.txt` that are made, and how many of each: the more of it homes hold and the more
its makes differ, the more.

A recipe's name seeds its draws: recipes come and go in any order, and no other make changes."""


def parametric_models(copies: float = 1.0, library: str = PARAMETRIC) -> list[tuple[Item, Soup, list[Look]]]:
    """Every model of one library made here: item, triangles, and the look of each of its material names.

    Args:
        copies: factor on how many are made of each kind; at least one is. The first so many are the
            same for every factor.
        library: `PARAMETRIC` or `UNSEEN`, which have no model in common.

    Returns:
        The same models at every call.
    """
    models, first = [], {PARAMETRIC: 0, UNSEEN: _FIRST_UNSEEN}[library]
    for name, count in PIECES.items():
        seed = zlib.crc32(name.encode())
        for copy in range(first, first + max(1, round(count * copies))):
            rng = np.random.default_rng([seed, copy])
            models.append(_finished(drawn(name, Draw(rng)), f"{name}-{copy}", library, rng))
    return models


def wood_textures() -> dict[str, bytes]:
    """Grain pictures as JPEG bytes by the name that materials use; rings stretched along u."""
    return {f"wood{k}": _wood(np.random.default_rng([77, k])) for k in range(NUM_WOODS)}


def _wood(rng: np.random.Generator) -> bytes:
    side = _TEXTURE_SIDE
    dark, light = _WOOD_TONES[int(rng.integers(len(_WOOD_TONES)))]
    v, u = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side), indexing="ij")
    waves = np.zeros((side, side))
    for _ in range(5):
        frequency, phase = rng.uniform(2, 14), rng.uniform(0, 6.28)
        bend = rng.uniform(0.01, 0.08) * np.sin(2 * np.pi * (u * rng.integers(1, 3) + rng.random()))
        waves += np.sin(2 * np.pi * frequency * (v + bend) + phase) / 5
    grain = rng.normal(0, 1, (side, 1)) * 0.12 + rng.normal(0, 1, (side, side)) * 0.04
    mix = np.clip(0.5 + 0.5 * waves + grain, 0, 1)[..., None]
    picture = np.array(dark) * (1 - mix) + np.array(light) * mix
    stream = io.BytesIO()
    Image.fromarray((picture * 255).astype(np.uint8)).save(stream, "JPEG", quality=85)
    return stream.getvalue()


def _finished(
    design: Design, copy: str, library: str, rng: np.random.Generator
) -> tuple[Item, Soup, list[Look]]:
    """The design as a model, a little wider or narrower, so that no two have one shape."""
    width, depth = rng.uniform(1 - _STRETCH, 1 + _STRETCH, 2)
    positions = np.concatenate([triangles for triangles, _ in design.parts]) * [width, 1.0, depth]
    looks = list(dict.fromkeys(look for _, look in design.parts))
    materials = np.concatenate([np.full(len(t), looks.index(look)) for t, look in design.parts])
    names = tuple(f"m{k}" for k in range(len(looks)))
    soup = Soup(positions, smooth_normals(positions), _plane_uvs(positions), materials, names)
    width, height, depth = np.ptp(positions.reshape(-1, 3), axis=0).tolist()
    item = Item(
        key=f"{copy}|{library}",
        library=library,
        name=design.name,
        tags=design.tags,
        category=design.category,
        group=design.group,
        size=(width, height, depth),
        elevation=design.elevation,
        surface=-1.0,
        opening=False,
        wall_front=0.8,
        light=design.light,
        rotation=tuple(np.eye(3).ravel()),
        creator="LangFlash",
        model="",
    )
    return item, soup, looks


def _plane_uvs(positions: Triangles) -> Float[np.ndarray, "F 3 2"]:
    """Texture coordinates over the plane that each triangle faces most; grain runs the long way."""
    normals = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    axis = np.abs(normals).argmax(1)
    planes = np.array([[2, 1], [0, 2], [0, 1]])[axis]
    extent = np.ptp(positions.reshape(-1, 3), axis=0)
    swap = extent[planes[:, 1]] > extent[planes[:, 0]]
    planes[swap] = planes[swap][:, ::-1]
    return np.take_along_axis(positions, planes[:, None].repeat(3, 1), 2) * _TILES_PER_M
