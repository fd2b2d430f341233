"""What lives as long as the scene: its Gaussians by level of detail, their marks, what its photos see."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from itertools import count

import moderngl
import numpy as np
import torch

from langflash_core.export.colours import atom_colours
from langflash_core.graphics import Programs
from langflash_core.scene.changed import changed
from langflash_core.scene.changes import Change
from langflash_core.scene.thin import thin_with_rows
from langflash_core.types import Camera, Gaussians, Scene

from .colours import feature_axes
from .painter import Painter
from .photos import PhotoDepths
from .shapes import MakeShapes
from .splats import SplatBuffers

MakeSplats = Callable[[moderngl.Context, Programs, Scene, MakeShapes], SplatBuffers]
Thinned = tuple[Scene, np.ndarray]
"""What `thin_with_rows` gives."""
_names = count(1)  # each given once, so that no two contents are ever taken for each other


class Level:
    """A share of a scene's Gaussians, ordered and projected for one camera at a time.

    `order_key` names the Gaussians and their order, `places_key` also their footprints and colours:
    what was drawn from another order or other places shows another key.
    """

    def __init__(self, splats: SplatBuffers, rows: np.ndarray, gaussians: Gaussians):
        """rows: of the scene's N Gaussians, that this level draws. gaussians: as it draws them."""
        self.splats = splats
        self.order_key = self.places_key = 0
        self._rows = rows
        self._gaussians = gaussians
        self._changes: tuple[Change, ...] | None = None  # to be brought to the card
        self._camera: tuple | None = None  # that the Gaussians are ordered for
        self._projected = False
        self._norms: tuple[bytes, np.ndarray] | None = None  # factor and |f_i|

    def prepare(self, camera: Camera) -> None:
        """Order and project the Gaussians, unless they are for this camera and these marks."""
        if self._changes is not None:
            self.splats.place(changed(self._gaussians, self._changes, torch.from_numpy(self._rows)))
            self._changes = None
        key = _camera_key(camera)
        if key != self._camera:
            self.splats.sort(camera)
            self._camera, self._projected, self.order_key = key, False, next(_names)
        if not self._projected:
            if len(self.splats.order):
                self.splats.project(camera)
            self._projected, self.places_key = True, next(_names)

    def mark(self, shown: np.ndarray, tints: np.ndarray) -> None:
        """Bring the scene's marks to this level: shown (N,) bool, tints (N,) uint8."""
        if self.splats.mark(shown[self._rows], tints[self._rows]):
            self._camera = None
        self._projected = False

    def change(self, changes: tuple[Change, ...]) -> None:
        """Draw the Gaussians as edits moved and recoloured them, from the next picture on."""
        self._changes, self._camera = changes, None

    @property
    def depth_range(self) -> tuple[float, float]:
        """Depths of the middle 96 % of the Gaussians in view, scene units."""
        return self.splats.depth_range

    def norms(self, factor: np.ndarray) -> np.ndarray:
        """|f_i| (N,) of the level's Gaussians over a dictionary with factor R (K, r); kept for the last R."""
        named = factor.tobytes()
        if self._norms is None or self._norms[0] != named:
            self._norms = named, np.linalg.norm(self.splats.carried.mixed(factor), axis=1)
        return self._norms[1]

    def forget(self) -> None:
        """Order and project anew for the next picture."""
        self._camera = None


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
        self._levels: dict[float, Level] = {}  # by share of the Gaussians
        if thinned is None:
            self.level(share)
        else:
            self.give(share, *thinned)

    @property
    def whole(self) -> Level:
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

    def level(self, share: float) -> Level:
        """The level of so many Gaussians; made once."""
        if share not in self._levels:
            everything = self.scene, np.arange(len(self.scene.gaussians))
            self._made(share, *(everything if share == 1 else thin_with_rows(self.scene, share)))
        return self._levels[share]

    def give(self, share: float, thinned: Scene, rows: np.ndarray) -> None:
        """The level of so many Gaussians as `thin_with_rows` made it, on whatever thread."""
        if share not in self._levels:
            self._made(share, thinned, rows)

    def photo_depths(self, own: bool) -> PhotoDepths:
        """What the photos see, of all Gaussians or each of its own alone; drawn once."""
        if own not in self._photos:
            gaussians = changed(self.scene.gaussians, self._changes)
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
        self._changes = changes
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

    def _made(self, share: float, scene: Scene, rows: np.ndarray) -> Level:
        painter = self._painter
        splats = self._make_splats(painter.ctx, painter.programs, scene, painter.shapes)
        level = self._levels[share] = Level(splats, rows, scene.gaussians)
        if self._changes:
            level.change(self._changes)
        if self._marks is not None:
            level.mark(*self._marks)
        return level

    def release(self) -> None:
        """Give every buffer and texture back."""
        for level in self._levels.values():
            level.splats.release()
        self._levels.clear()
        self._drop_photos()


def _camera_key(camera: Camera) -> tuple:
    pose, K = (m.detach().cpu().double().numpy().tobytes() for m in (camera.viewmat, camera.K))
    light = None if camera.light is None else camera.light.cpu().numpy().tobytes()
    return pose, K, camera.width, camera.height, camera.orthographic, light
