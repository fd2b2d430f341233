"""Furniture drawn by rules: endless makes of the things that homes are full of. Metres, y up, front +z.

The catalogues hold a handful of models of each class, and a network that has seen four wardrobes
knows four wardrobes. Each maker draws sizes, proportions, parts and materials anew from a generator,
within what people sell. One library to train on, and one of other makes to validate on; what a
checkpoint is judged by at the end comes from neither.
"""

import io

import numpy as np
from jaxtyping import Float
from PIL import Image

from langflash_core.rooms import makers_fittings as fittings
from langflash_core.rooms import makers_furniture as furniture
from langflash_core.rooms import makers_small as small
from langflash_core.rooms.catalogue import PARAMETRIC, UNSEEN, Item
from langflash_core.rooms.makers_common import NUM_WOODS, Design, Draw, Look, Maker
from langflash_core.rooms.objfile import Soup, smooth_normals
from langflash_core.rooms.solids import Triangles

_TEXTURE_SIDE = 128
_TILES_PER_M = 1.3
_FIRST_UNSEEN = 1000  # copies are counted from here; no maker makes as many
_WOOD_TONES = (
    ((0.62, 0.45, 0.28), (0.78, 0.62, 0.43)),
    ((0.30, 0.19, 0.11), (0.45, 0.30, 0.19)),
    ((0.74, 0.60, 0.42), (0.88, 0.76, 0.58)),
    ((0.45, 0.24, 0.13), (0.62, 0.38, 0.22)),
    ((0.20, 0.14, 0.10), (0.31, 0.22, 0.16)),
    ((0.66, 0.60, 0.53), (0.80, 0.75, 0.68)),
)

# A maker's row seeds its draws: new makers go to the end.
MAKERS: tuple[tuple[Maker, int], ...] = (
    (furniture.chair, 48),
    (furniture.office_chair, 18),
    (furniture.armchair, 30),
    (furniture.sofa, 36),
    (furniture.stool, 20),
    (furniture.bench, 12),
    (furniture.pouf, 12),
    (furniture.table, 36),
    (furniture.coffee_table, 24),
    (furniture.desk, 30),
    (furniture.bedside_table, 20),
    (furniture.bed, 36),
    (furniture.crib, 8),
    (furniture.wardrobe, 28),
    (furniture.dresser, 24),
    (furniture.cupboard, 28),
    (fittings.base_cabinet, 20),
    (fittings.wall_cabinet, 12),
    (furniture.bookcase, 30),
    (furniture.tv_stand, 18),
    (fittings.refrigerator, 16),
    (fittings.stove, 16),
    (fittings.washing_machine, 8),
    (fittings.microwave, 8),
    (fittings.sink, 18),
    (fittings.sink_unit, 12),
    (fittings.toilet, 14),
    (fittings.bathtub, 14),
    (fittings.shower, 12),
    (fittings.radiator, 14),
    (fittings.floor_lamp, 18),
    (fittings.table_lamp, 20),
    (fittings.pendant_lamp, 18),
    (fittings.tv, 16),
    (fittings.computer, 24),
    (fittings.speaker, 12),
    (small.plant, 48),
    (small.vase, 20),
    (small.bottle, 16),
    (small.cup, 12),
    (small.bowl, 12),
    (small.fruit, 10),
    (small.crate, 14),
    (small.basket, 10),
    (small.trash_bin, 14),
    (small.clock, 12),
    (small.toy, 14),
)
"""What is made and how many of each: the more of it homes hold and the more its makes differ, the more."""


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
    for row, (maker, count) in enumerate(MAKERS):
        for copy in range(first, first + max(1, round(count * copies))):
            design = maker(Draw(np.random.default_rng([row, copy])))
            models.append(_finished(design, f"{design.group}-{row}-{copy}", library))
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


def _finished(design: Design, copy: str, library: str) -> tuple[Item, Soup, list[Look]]:
    positions = np.concatenate([triangles for triangles, _ in design.parts])
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
