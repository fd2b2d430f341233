"""What lives as long as the scene: its Gaussians by level of detail, their marks, what its photos see."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from langflash_core.export.colours import atom_colours
from langflash_core.geometry.nearness import Nearness
from langflash_core.scene.changed import apply_changes
from langflash_core.scene.changes import Change
from langflash_core.scene.thin import thin_with_rows
from langflash_core.types import Scene

from .colours import feature_axes
from .layered import LayeredLevel, Prepared
from .level import Level
from .painter import Painter
from .photos import PhotoDepths
from .splats import Drawable, MakeSplats, SplatBuffers


@dataclass(frozen=True)
class Thinned:
    """Some of a scene's Gaussians, made on whatever thread. scene: of n of them; rows: (n,), which of the
    whole scene's these are. drawable: it, made ready for the card; None: not yet."""

    scene: Scene
    rows: np.ndarray
    drawable: Drawable | None = None


class LiveScene:
    """Owns what of a scene is on the graphics card."""

    def __init__(
        self,
        painter: Painter,
        scene: Scene,
        make_splats: MakeSplats = SplatBuffers,
        share: float = 1.0,
        thinned: Thinned | None = None,
    ):
        """share: of the Gaussians, that is uploaded at once; others as they are wanted. thinned: to that
        share, where it is made already."""
        self.scene = scene
        self._painter = painter
        self._make_splats = make_splats
        self._marks: tuple[np.ndarray, np.ndarray] | None = None  # shown, tints
        self._changes: tuple[Change, ...] = ()
        self._photos: dict[bool, PhotoDepths] = {}  # by whether each sees its own Gaussians alone
        self._levels: dict[float, Prepared] = {}  # by share of the Gaussians
        self._thinned: dict[float, Thinned] = {}  # that these were made of
        self._next: dict[float, Thinned] = {}  # to come in place of those
        self._past: list[Prepared] = []  # which the picture on show may still need
        self._near: Nearness | None = None
        if thinned is None:
            self.level(share)
        else:
            self.give(share, thinned)

    @property
    def whole(self) -> Prepared:
        """Of all Gaussians."""
        return self.level(1.0)

    @property
    def num_atoms(self) -> int:
        return self.scene.semantics.num_atoms

    @cached_property
    def atom_colours(self) -> np.ndarray:
        """(K, 3), of the whole dictionary."""
        return atom_colours(self.scene.semantics.dictionary.detach().cpu().double().numpy())

    @cached_property
    def feature_columns(self) -> np.ndarray:
        """Affine colours (K, 4) of the atoms, of the whole scene: see `feature_axes`."""
        semantics = self.scene.semantics
        masses = np.zeros(semantics.num_atoms)
        carried = semantics.weight_values.double() * self.scene.gaussians.opacities.double()[:, None]
        np.add.at(masses, semantics.weight_ids.numpy(), carried.nan_to_num(0, 0, 0).numpy())
        return feature_axes(semantics.dictionary.double().numpy(), masses)

    def level(self, share: float) -> Prepared:
        """The level of so many Gaussians; made once, until another is given."""
        following = self._next.pop(share, None)
        if following is not None:
            self._past.append(self._levels.pop(share))
            self._make(share, following)
        elif share not in self._levels:
            everything = self.scene, np.arange(len(self.scene.gaussians))
            self._make(share, Thinned(*(everything if share == 1 else thin_with_rows(self.scene, share))))
        return self._levels[share]

    def give(self, share: float, thinned: Thinned) -> None:
        """The level of so many Gaussians; in place of one that is there from the next picture on."""
        if share in self._levels:
            self._next[share] = thinned
        else:
            self._make(share, thinned)

    def draw_with(self, make_splats: MakeSplats) -> None:
        """Make every level anew, of other buffers, as its next picture comes."""
        self._make_splats = make_splats
        self._next = {**self._thinned, **self._next}

    def forget_past(self) -> None:
        """Give levels back in whose place others came, once another picture is on show."""
        while self._past:
            self._past.pop().release()

    def nearness(self) -> Nearness:
        """Which layers a camera sees, of a layered scene as edits left it."""
        if self._near is None:
            gaussians = apply_changes(self.scene.gaussians, self._changes)
            self._near = Nearness.of(replace(self.scene, gaussians=gaussians))
        return self._near

    def photo_depths(self, own: bool) -> PhotoDepths:
        """What the photos see, of all Gaussians or each of its own alone; of a layered scene its layer. Drawn
        once."""
        own = own or self.scene.layered
        if own not in self._photos:
            gaussians = apply_changes(self.scene.gaussians, self._changes)
            self._photos[own] = PhotoDepths(self._painter, replace(self.scene, gaussians=gaussians), own)
        return self._photos[own]

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> None:
        """Draw only some Gaussians, and some in a tint.

        Args:
            shown: (N,) bool. tints: (N,) uint8, 0 for the own colour.
        """
        self._marks = shown, tints
        for level in self._levels.values():
            level.mark(shown, tints)

    def change(self, changes: tuple[Change, ...]) -> None:
        """Draw the Gaussians as edits moved and recoloured them; all changes of the scene, in order."""
        self._changes, self._near = changes, None
        for level in self._levels.values():
            level.change(changes)
        self._drop_photos()

    def _drop_photos(self) -> None:
        for photos in self._photos.values():
            photos.release()
        self._photos.clear()

    def forget(self) -> None:
        """Order and project every level anew for its next picture."""
        for level in self._levels.values():
            level.forget()

    def _make(self, share: float, thinned: Thinned) -> None:
        scene, rows = thinned.scene, thinned.rows
        self._thinned[share] = replace(thinned, drawable=None)
        if scene.layered and self.nearness().views:
            level = LayeredLevel(scene, rows, self._level_of, self.nearness)
        else:
            level = self._level_of(scene, rows, thinned.drawable)
        self._levels[share] = level
        if self._changes:
            level.change(self._changes)
        if self._marks is not None:
            level.mark(*self._marks)

    def _level_of(self, scene: Scene, rows: np.ndarray, drawable: Drawable | None = None) -> Level:
        painter = self._painter
        splats = self._make_splats(painter.ctx, painter.programs, drawable or scene, painter.shapes)
        return Level(splats, rows, scene.gaussians)

    def release(self) -> None:
        """Give every buffer and texture back."""
        for level in self._levels.values():
            level.release()
        self._levels.clear()
        self._next.clear()
        self.forget_past()
        self._drop_photos()
