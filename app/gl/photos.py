"""What each photo sees: the depths of a scene in the views of its own photos, drawn once per scene."""

import moderngl
import numpy as np

from langflash_core.language.settings import ANSWERING
from langflash_core.surface.settings import CONSISTENCY
from langflash_core.types import Camera, Scene

from .ordering import lens, matrices
from .painter import Painter
from .splats import SplatBuffers
from .targets import ColourTarget, mean_depths, read

SAME = 0.05
"""Relative depth within which a photo shows the very surface: a pixel of 1/200 of the focal length on a floor
seen at 80 degrees from upright spans 0.03."""
WORST = CONSISTENCY.tolerance
"""Relative depth from which the depths of two photos disagree altogether."""
MOST_PHOTOS = 32  # matrices of so many fit any driver's uniforms
LONGEST_SIDE = 320  # pixels of a depth map
_CAPACITIES = (2, 4, 8, 16, 32)


class PhotoDepths:
    """Depth maps of at most `MOST_PHOTOS` photos, spread evenly over all, as layers of one texture.

    own: every photo sees only the Gaussians that it made itself.
    """

    def __init__(self, painter: Painter, scene: Scene, own: bool):
        views = spread(scene.num_views)
        self.cameras = tuple(_small(scene.camera(view)) for view in views)
        ctx, programs = painter.ctx, painter.programs
        whole = None if own else SplatBuffers(ctx, programs, scene, painter.shapes)
        maps = []
        for view, camera in zip(views, self.cameras, strict=True):
            splats = whole or SplatBuffers(ctx, programs, _own_scene(scene, view), painter.shapes)
            maps.append(_depths(painter, splats, camera))
            if splats is not whole:
                splats.release()
        if whole is not None:
            whole.release()
        size = (self.cameras[0].width, self.cameras[0].height)
        self.texture = ctx.texture_array((*size, len(maps)), 1, np.stack(maps).tobytes(), dtype="f4")
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)

    @property
    def capacity(self) -> int:
        """Photos that a program is compiled for: a few sizes only."""
        return next(size for size in _CAPACITIES if len(self.cameras) <= size)

    def uniforms(self, camera: Camera) -> dict[str, np.ndarray | int]:
        """Values of photos.glsl for a picture drawn by `camera`."""
        back = np.linalg.inv(matrices(camera)[0])
        pinholes = np.zeros((self.capacity, 4))
        to_photos = np.tile(np.eye(4), (self.capacity, 1, 1))
        for photo, seen in enumerate(self.cameras):
            pinholes[photo] = lens(seen)["pinhole"]
            to_photos[photo] = matrices(seen)[0] @ back
        photos = {"num_photos": len(self.cameras), "pinholes": pinholes, "to_photos": to_photos}
        return {**photos, **lens(camera)}

    def release(self) -> None:
        self.texture.release()


def spread(count: int) -> list[int]:
    """At most `MOST_PHOTOS` of so many photos, the first and the last of them too, evenly."""
    if count <= MOST_PHOTOS:
        return list(range(count))
    return [k * (count - 1) // (MOST_PHOTOS - 1) for k in range(MOST_PHOTOS)]


def photo_places(scene: Scene, camera: Camera) -> np.ndarray:
    """(n, 4) float32: where the nearest `MOST_PHOTOS` stand, x y z 1 in the axes of a picture's camera."""
    poses = scene.viewmats.detach().cpu().double().numpy()
    places = np.linalg.inv(poses)[:, :, 3] @ matrices(camera)[0].T
    nearest = np.argsort(np.linalg.norm(places[:, :3], axis=1), kind="stable")[:MOST_PHOTOS]
    return places[nearest].astype(np.float32)


def _small(camera: Camera) -> Camera:
    ratio = min(1.0, LONGEST_SIDE / max(camera.width, camera.height))
    return camera.with_size(max(1, round(camera.width * ratio)), max(1, round(camera.height * ratio)))


def _own_scene(scene: Scene, view: int) -> Scene:
    """The Gaussians that photo `view` made; of a layered scene its layer.

    Raises:
        ValueError: the scene does not say which.
    """
    if scene.view_ids is None:
        raise ValueError("view_ids: expected the photo that made each Gaussian, received none")
    if scene.layered:
        return scene.layer(view)
    return scene.rows(scene.view_ids == view)


def _depths(painter: Painter, splats: SplatBuffers, camera: Camera) -> np.ndarray:
    """z (H, W) float32 of covered pixels, 0 elsewhere."""
    target = ColourTarget(painter.ctx, (camera.width, camera.height), "f2")
    if splats.num_gaussians:
        splats.sort(camera)
    if len(splats.order):
        splats.project(camera)
    splats.splat(target.framebuffer)
    sums = read(target.depth).reshape(camera.height, camera.width, 2)
    target.release()
    return mean_depths(sums, ANSWERING.covered_alpha)
