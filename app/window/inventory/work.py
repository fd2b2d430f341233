"""The worker's side of the inventory: what is in the room, with a small picture of each thing. Heavy imports
wait until they are needed."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from langflash_core.base.picture_files import STORED, opened_picture
from langflash_core.geometry import rotations
from langflash_core.scene.edits import Marks
from langflash_core.scene.mask import Mask

from ..commands import Command, ShowPicture
from ..requests import Asked, SceneTask
from ..scene.memory import SceneMemory
from .commands import Listed, NotListed
from .state import Row

if TYPE_CHECKING:
    from langflash_core.inventory import Inventory, Thing
    from langflash_core.types import Scene

SIDE = 96  # pixels of a small picture
_AROUND = 0.06  # of a thing's longer side, that its picture shows around it


@dataclass(frozen=True)
class TakeInventory(SceneTask):
    """List the things of the scene as edited."""

    newest_counts = True

    memory: SceneMemory = field(repr=False)
    marks: Marks

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.inventory import inventory
        from langflash_core.scene.edited import spoken_scene, without_deleted

        spoken = spoken_scene(self.memory.changed(self.marks), self.marks)
        scene = without_deleted(spoken, self.marks).with_record(
            world=self.marks.world, metric_scale=self.marks.metric_scale, thing_names=self.marks.thing_names
        )
        found = inventory(scene)
        if stopping():
            return
        there = self.marks.left.rows()
        listed = tuple(_row(found, number, there) for number in range(len(found.things)))
        yield Listed(listed, found.unit, found.guess)
        for thing in found.things:
            rgb = small_picture(scene, found.scene.gaussians.means.numpy()[thing.rows], thing.photos)
            if rgb is not None:
                yield ShowPicture(f"thing {thing.id}", rgb)

    def failed(self, sentence: str) -> Iterable[Command]:
        """There is no list; the panel says why."""
        return (NotListed(sentence),)


def _row(found: "Inventory", number: int, there: np.ndarray) -> Row:
    """Of one of its things. there (N,): the rows of the scene that it was made of."""
    thing, rows = found.things[number], np.zeros(len(there), bool)
    rows[there] = found.numbers == number
    return Row(
        thing.id, thing.kind, thing.sure, thing.place, thing.size, thing.bottom, thing.photos, thing.cut,
        Mask.of(rows), corners_of(found, thing), thing.thin,
    )  # fmt: skip


def corners_of(found: "Inventory", thing: "Thing") -> Float[np.ndarray, "8 3"]:
    """Of a thing's box, in the scene's own axes and unit: the lower four around it, then the upper four."""
    flat = thing.corners  # (4, 2) east, north
    levels = [np.full((4, 1), -thing.bottom), np.full((4, 1), -thing.bottom - thing.size[2])]
    stands = np.concatenate([np.concatenate((flat[:, :1], level, flat[:, 1:]), 1) for level in levels])
    return stands / found.scale @ rotations.matrix(found.world.turn) + np.array(found.world.origin)


def small_picture(
    scene: "Scene", means: Float[np.ndarray, "n 3"], photos: Sequence[int]
) -> np.ndarray | None:
    """(h, w, 3) uint8: a thing in the photo that shows it best; None where no photo is left that does."""
    if not photos or photos[0] >= len(scene.photos):
        return None
    camera = scene.camera(photos[0])
    pos_c = means @ camera.viewmat[:3, :3].numpy().T + camera.viewmat[:3, 3].numpy()
    pos_c = pos_c[pos_c[:, 2] > 0]
    if not len(pos_c):
        return None
    pixels = (pos_c / pos_c[:, 2:]) @ camera.K.numpy()[:2].T
    low, high = np.quantile(pixels, (0.02, 0.98), axis=0) / (camera.width, camera.height)
    try:
        with opened_picture(scene.photos[photos[0]], STORED) as opened:
            size = np.array(opened.size)
            margin = _AROUND * (high - low).max()
            left, top = np.floor(np.clip(low - margin, 0, 1) * size)
            right, bottom = np.ceil(np.clip(high + margin, 0, 1) * size)
            if right - left < 2 or bottom - top < 2:
                return None
            cut = opened.convert("RGB").crop((int(left), int(top), int(right), int(bottom)))
            cut.thumbnail((SIDE, SIDE))
            return np.asarray(cut)
    except (OSError, SyntaxError, ValueError):  # a damaged photo shows nothing, and stops nothing
        return None
