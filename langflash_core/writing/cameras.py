"""Which camera to draw: a photo's own (`--view`), or one described in a JSON file (`--camera`)."""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from langflash_core.base.files import readable_file
from langflash_core.base.formats import LARGEST_SIDE
from langflash_core.base.limits import TEXT
from langflash_core.base.picture_files import STORED, opened_picture
from langflash_core.errors import ViewError
from langflash_core.geometry.reach import median_reach
from langflash_core.scene.exposure import lit_camera
from langflash_core.types import Camera, Scene

# |R R^T - 1| per entry: rotations written by hand carry four or five decimals.
RIGID_TOLERANCE = 1e-3

Matrix = list[list[float]]


@dataclass(frozen=True)
class CameraChoice:
    """What the command line says about the camera, checked as far as it can be without a scene.

    view: index of a photo, None when `described` holds a camera. size: (width, height) to
    draw, None for the camera's own. ortho: by parallel rays. full: where no size is said, a photo's camera
    has as many pixels as the photo that the scene keeps, not as the network saw.
    """

    view: int | None
    described: Camera | None
    size: tuple[int, int] | None
    ortho: bool = False
    full: bool = False

    def at_full_size(self) -> "CameraChoice":
        """For pictures that people look at, or lay over the photos."""
        return replace(self, full=True)

    def of(self, scene: Scene) -> Camera:
        """The camera for `scene`.

        Raises:
            ViewError: the scene has no such view.
        """
        if self.described is not None:
            camera = self.described if self.size is None else self.described.with_size(*self.size)
            return lit_camera(scene, self._by_rays(camera, scene))
        return self.of_photo(scene, self.view or 0)

    def of_photo(self, scene: Scene, view: int) -> Camera:
        """The camera of a photo, with size and rays as asked for.

        Raises:
            ViewError: the scene has no such view.
        """
        if not 0 <= view < scene.num_views:
            last = f" to {scene.num_views}" if scene.num_views > 1 else ""
            raise ViewError(
                f"there is no photo {view + 1}: this scene has {scene.num_views}; use --view 1{last}"
            )
        size = self.size or (kept_size(scene, view) if self.full else scene.view_size)
        return lit_camera(scene, self._by_rays(scene.camera(view, *size), scene))

    def _by_rays(self, camera: Camera, scene: Scene) -> Camera:
        if not self.ortho or camera.orthographic:
            return camera
        means, K = scene.gaussians.means.double().numpy(), camera.K.double().numpy()
        finite = means[np.isfinite(means).all(1)]
        depth = median_reach(finite, camera.viewmat.double().numpy(), K, (camera.width, camera.height))
        per_unit = camera.K / camera.K.new_tensor([[depth], [depth], [1.0]])
        per_unit[:2, 2] = camera.K[:2, 2]
        return replace(camera, K=per_unit, orthographic=True)


def kept_size(scene: Scene, view: int) -> tuple[int, int]:
    """(width, height) in pixels of the photo that a scene keeps of a view; as the network saw it where it
    keeps none, or a damaged one."""
    if not scene.photos:
        return scene.view_size
    try:
        with opened_picture(scene.photos[view], STORED) as picture:
            return picture.size
    except (OSError, SyntaxError, ValueError):
        return scene.view_size


def chosen_camera(
    view: int | None, camera: Path | None, size: tuple[int, int] | None, ortho: bool
) -> CameraChoice:
    """A choice of what --view, --camera, --size and --ortho say.

    Raises:
        ViewError: the camera file cannot be used.
    """
    described = None if camera is None else read_camera(camera)
    return CameraChoice(None if described else view or 0, described, size, ortho)


def read_camera(path: Path) -> Camera:
    """A camera from JSON: {"viewmat": 4 x 4 world to camera, "K": 3 x 3 pixels, "width", "height"}; with
    "orthographic": true its rays are parallel, and K's focal lengths are pixels per scene unit.

    Raises:
        ViewError: missing, not JSON, or not a rigid pose with a usable pinhole K.
    """
    readable_file(path, "camera file", ViewError)
    TEXT.check(path.stat().st_size, path.name, ViewError)
    try:
        fields = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        fields = None
    return camera_of(fields, str(path))


def camera_of(fields: Any, path: str) -> Camera:
    """A camera from what a JSON file holds, as `read_camera`; `path` names it in messages.

    Raises:
        ViewError: as `read_camera`.
    """
    try:
        viewmat, K = _matrix(fields["viewmat"], 4), _matrix(fields["K"], 3)
        width, height = fields["width"], fields["height"]
        orthographic = fields.get("orthographic", False)
    except KeyError as missing:
        raise ViewError(
            f"{path} has no {missing}; a camera file holds viewmat, K, width and height"
        ) from None
    except TypeError:
        raise ViewError(
            f"{path} is not a camera file: expected a JSON object with viewmat, K, width and height"
        ) from None
    except ValueError as problem:
        raise ViewError(
            f"{path} is not a camera file: {problem}; it holds viewmat, K, width and height"
        ) from None
    if not isinstance(orthographic, bool):
        raise ViewError(f"{path}: orthographic must be true or false, not {orthographic!r}")
    problem = _size_problem(width, height) or _pose_problem(viewmat) or _pinhole_problem(K)
    if problem:
        raise ViewError(f"{path}: {problem}")
    return Camera(torch.tensor(viewmat), torch.tensor(K), width, height, orthographic)


def _matrix(rows: Any, side: int) -> Matrix:
    lists = [rows, *rows] if isinstance(rows, list) else [rows]
    if len(lists) != side + 1 or not all(isinstance(each, list) and len(each) == side for each in lists):
        raise ValueError(f"expected {side} rows of {side} numbers")
    try:
        matrix = torch.tensor([[float(value) for value in row] for row in rows]).tolist()
    except OverflowError:
        matrix = [[math.inf]]
    if not all(math.isfinite(value) for row in matrix for value in row):
        raise ValueError("a number is not finite in float32")
    return matrix


def _size_problem(width: Any, height: Any) -> str | None:
    whole = all(isinstance(side, int) and not isinstance(side, bool) for side in (width, height))
    if whole and min(width, height) >= 1 and max(width, height) <= LARGEST_SIDE:
        return None
    return f"width and height must be whole numbers from 1 to {LARGEST_SIDE}, not {width} and {height}"


def _pose_problem(viewmat: Matrix) -> str | None:
    rotation = np.array(viewmat)[:3, :3]
    if abs(rotation @ rotation.T - np.eye(3)).max() > RIGID_TOLERANCE or np.linalg.det(rotation) < 0:
        return "viewmat's upper left 3 x 3 must be a rotation, without scale or mirror"
    if viewmat[3] != [0.0, 0.0, 0.0, 1.0]:
        return "viewmat's last row must be 0 0 0 1"
    return None


def _pinhole_problem(K: Matrix) -> str | None:
    if K[0][0] <= 0 or K[1][1] <= 0:
        return "K's focal lengths must be above 0"
    if K[0][1] or K[1][0] or K[2] != [0.0, 0.0, 1.0]:
        return "K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], without skew"
    return None
