"""Furniture drawn by rules: endless makes of the things that homes are full of. Metres, y up, front +z.

The catalogues hold a handful of models of each class, and a network that has seen four wardrobes
knows four wardrobes. Each maker draws sizes, proportions, parts and materials anew from a generator,
within what people sell. One library to train on, and one of other makes to validate on; what a
checkpoint is judged by at the end comes from neither.
"""

import io
import zlib

import numpy as np
from jaxtyping import Float
from PIL import Image

from langflash_core.lab.rooms.catalogue import PARAMETRIC, UNSEEN, Item
from langflash_core.lab.rooms.makers import (
    animals,
    appliances,
    bathing,
    beds,
    containers,
    desks,
    devices,
    fire,
    fittings,
    furnishing,
    furniture,
    greens,
    hall,
    kitchen,
    music,
    play,
    seats,
    small,
    storage,
    study,
    textiles,
    toys,
    trifles,
    washing,
    water,
    wheels,
)
from langflash_core.lab.rooms.makers.common import NUM_WOODS, Design, Draw, Look, Maker
from langflash_core.lab.rooms.objfile import Soup, smooth_normals
from langflash_core.lab.rooms.solids import Triangles

_TEXTURE_SIDE = 128
_TILES_PER_M = 1.3
_STRETCH = 0.04  # less than one sees on what is round
_FIRST_UNSEEN = 1000  # copies are counted from here; no maker makes as many
_WOOD_TONES = (
    ((0.62, 0.45, 0.28), (0.78, 0.62, 0.43)),
    ((0.30, 0.19, 0.11), (0.45, 0.30, 0.19)),
    ((0.74, 0.60, 0.42), (0.88, 0.76, 0.58)),
    ((0.45, 0.24, 0.13), (0.62, 0.38, 0.22)),
    ((0.20, 0.14, 0.10), (0.31, 0.22, 0.16)),
    ((0.66, 0.60, 0.53), (0.80, 0.75, 0.68)),
)

MAKERS: tuple[tuple[Maker, int], ...] = (
    (furniture.office_chair, 18),
    (furniture.stool, 20),
    (furniture.bench, 12),
    (furniture.pouf, 12),
    (furniture.coffee_table, 24),
    (furniture.bedside_table, 20),
    (furniture.crib, 8),
    (fittings.base_cabinet, 20),
    (fittings.wall_cabinet, 12),
    (fittings.washing_machine, 8),
    (fittings.microwave, 8),
    (fittings.sink_unit, 12),
    (fittings.radiator, 14),
    (fittings.computer, 24),
    (fittings.speaker, 12),
    (small.bottle, 16),
    (small.bowl, 12),
    (small.fruit, 10),
    (small.basket, 10),
    (washing.towel, 10),
    (washing.towel_rack, 8),
    (washing.toilet_paper_holder, 8),
    (washing.toilet_brush, 8),
    (washing.bidet, 8),
    (washing.urinal, 8),
    (washing.potty, 8),
    (washing.scale, 8),
    (washing.soap, 8),
    (washing.brush, 8),
    (washing.comb, 8),
    (washing.cosmetics, 8),
    (washing.sponge, 8),
    (washing.drying_rack, 8),
    (washing.broom, 8),
    (washing.mat, 8),
    (washing.water_heater, 8),
    (washing.mirror, 12),
    (hall.hanging_clothes, 8),
    (hall.clothes, 10),
    (hall.coat_hanger, 8),
    (hall.fire_extinguisher, 8),
    (hall.air_conditioner, 8),
    (hall.fan, 8),
    (hall.ceiling_fan, 8),
    (hall.water_cooler, 8),
    (hall.ladder, 8),
    (hall.umbrella, 8),
    (hall.bag, 12),
    (hall.suitcase, 8),
    (hall.room_divider, 8),
    (hall.mannequin, 8),
    (hall.person, 10),
    (hall.christmas_tree, 8),
    (hall.gift, 8),
    (hall.safe, 8),
    (hall.aquarium, 8),
    (kitchen.dishwasher, 8),
    (kitchen.range_hood, 8),
    (kitchen.kitchen_island, 10),
    (kitchen.coffee_machine, 10),
    (kitchen.kettle, 8),
    (kitchen.teapot, 8),
    (kitchen.toaster, 8),
    (kitchen.kitchen_appliance, 10),
    (kitchen.pan, 8),
    (kitchen.kitchen_utensil, 8),
    (kitchen.jar, 8),
    (kitchen.tray, 8),
    (kitchen.salt_shaker, 8),
    (kitchen.paper_towel_holder, 8),
    (fire.candle, 8),
    (fire.ashtray, 8),
    (kitchen.bread, 8),
    (kitchen.barrel, 8),
    (kitchen.high_chair, 8),
    (fire.firewood, 8),
    (fire.fireplace, 10),
    (kitchen.piano, 10),
    (furnishing.dressing_table, 8),
    (furnishing.bunk_bed, 8),
    (textiles.mattress, 8),
    (textiles.rug, 12),
    (textiles.curtain, 10),
    (textiles.blanket, 8),
    (textiles.cushion, 10),
    (textiles.picture, 14),
    (textiles.book, 12),
    (furnishing.chair, 64),
    (furnishing.table, 50),
    (furnishing.lamp, 72),
    (furnishing.bookcase, 42),
    (furnishing.cupboard, 40),
    (devices.keyboard, 8),
    (devices.phone, 10),
    (devices.printer, 8),
    (devices.tablet, 8),
    (devices.headphones, 8),
    (devices.game_controller, 8),
    (devices.remote_control, 8),
    (devices.player, 8),
    (devices.camera, 8),
    (devices.projector, 8),
    (study.whiteboard, 8),
    (study.calendar, 8),
    (study.newspaper, 8),
    (study.stationery, 8),
    (study.flashlight, 8),
    (study.keys, 8),
    (study.glasses, 8),
    (study.watch, 8),
    (study.switch, 8),
    (study.socket, 8),
    (study.dartboard, 8),
    (study.tool, 8),
    (music.musical_instrument, 12),
    (play.game_table, 10),
    (play.fitness_machine, 8),
    (play.sports_gear, 10),
    (wheels.bicycle, 10),
    (wheels.tricycle, 8),
    (wheels.skateboard, 8),
    (wheels.stroller, 8),
    (wheels.wheelchair, 8),
    (animals.teddy_bear, 8),
    (animals.cat, 8),
    (animals.dog, 8),
    (animals.rabbit, 8),
    (textiles.sleeping_bag, 8),
    (toys.toy, 26),
    (beds.bed, 52),
    (seats.sofa, 52),
    (seats.armchair, 44),
    (desks.desk, 42),
    (storage.wardrobe, 40),
    (storage.dresser, 36),
    (storage.tv_stand, 28),
    (water.sink, 28),
    (water.toilet, 22),
    (bathing.bathtub, 22),
    (bathing.shower, 20),
    (appliances.stove, 26),
    (appliances.refrigerator, 24),
    (appliances.tv, 24),
    (greens.plant, 62),
    (trifles.vase, 28),
    (trifles.clock, 20),
    (containers.storage_box, 22),
    (trifles.cup, 20),
    (containers.trash_bin, 22),
)
"""What is made and how many of each: the more of it homes hold and the more its makes differ, the more.

A maker's name seeds its draws: makers come and go in any order, and no other make changes."""


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
    for maker, count in MAKERS:
        seed = zlib.crc32(maker.__name__.encode())
        for copy in range(first, first + max(1, round(count * copies))):
            rng = np.random.default_rng([seed, copy])
            models.append(_finished(maker(Draw(rng)), f"{maker.__name__}-{copy}", library, rng))
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
