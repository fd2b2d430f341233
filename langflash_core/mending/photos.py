"""Photos inside a scene, painted over where they show a part: with what the scene itself shows there now.

Nothing of the old pixels goes into the new ones, so what the scene no longer holds, no photo does. A photo
that shows nothing of the part keeps its bytes; the others are written anew, without any data beside their
pixels.

Sizes: H W pixels of a view, h w of its photo.
"""

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.ndimage import distance_transform_edt

from langflash_core.base.picture_files import decoded_photo, encoded
from langflash_core.errors import SceneFileError
from langflash_core.export.png import to_8bit
from langflash_core.mending.settings import HIDDEN_PHOTOS
from langflash_core.scene.exposure import lit_camera
from langflash_core.scene.gaps import fill_gaps
from langflash_core.types import Camera, Scene

from .looks import Render


def dilate_mask(mask: Bool[np.ndarray, "H W"], margin: float) -> Bool[np.ndarray, "H W"]:
    """The mask with all within a margin of it, as a share of the longer side; two pixels at least."""
    return reaches(mask) <= margin


def reaches(mask: Bool[np.ndarray, "H W"]) -> Float[np.ndarray, "H W"]:
    """The margin, of the longer side, from which on each pixel is within it: 0 up to two pixels from the
    mask, infinite where that is empty."""
    if not mask.any():
        return np.full(mask.shape, np.inf, np.float32)
    far = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.where(far <= HIDDEN_PHOTOS.least, 0.0, far / max(mask.shape)).astype(np.float32)


def nearest_in(values: Float[np.ndarray, "H W"], mask: Bool[np.ndarray, "H W"]) -> Float[np.ndarray, "H W"]:
    """Of each pixel the value of the nearest one of a mask, which is not empty."""
    rows, columns = np.asarray(distance_transform_edt(~mask, return_distances=False, return_indices=True))
    return values[rows, columns]


def painted_over(scene: Scene, view: int, mask: Bool[np.ndarray, "H W"], render: Render) -> bytes:
    """A photo with what the scene shows in its place where the mask is, as JPEG.

    Args:
        scene: as it is to be written. mask: of the view.

    Raises:
        SceneFileError: the photo cannot be read.
    """
    photo = _decode_photo(scene.photos[view], view)
    height, width = photo.shape[:2]
    covered = cv2.resize(mask.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)
    blurred = cv2.GaussianBlur((covered > 0).astype(np.float32), (0, 0), width / mask.shape[1])
    covered = blurred > HIDDEN_PHOTOS.rounded
    shown = _render_as_photo(scene, scene.camera(view, width, height), render)
    painted = np.where(covered[..., None], shown, photo)
    return encoded(painted, "JPEG", quality=HIDDEN_PHOTOS.quality)


def not_in_scene(scene: Scene, view: int, render: Render) -> Bool[np.ndarray, "H W"]:
    """Pixels of a view whose photo shows what the scene does not: who walked by, and no phrase finds.

    Raises:
        SceneFileError: the photo cannot be read.
    """
    width, height = scene.view_size
    photo = cv2.resize(_decode_photo(scene.photos[view], view), (width, height), interpolation=cv2.INTER_AREA)
    shown = _render_as_photo(scene, scene.camera(view), render)
    apart = abs(photo.astype(np.float32) - shown.astype(np.float32)).mean(-1) / 255
    return cv2.blur(apart, (HIDDEN_PHOTOS.patch, HIDDEN_PHOTOS.patch)) > HIDDEN_PHOTOS.strange


def _decode_photo(photo: bytes, view: int) -> UInt8[np.ndarray, "h w 3"]:
    pixels = decoded_photo(photo)
    if pixels is None:
        raise SceneFileError(
            f"photo {view + 1} inside the scene is damaged; leave all photos out with --photos none"
        )
    return pixels


def _render_as_photo(scene: Scene, camera: Camera, render: Render) -> UInt8[np.ndarray, "h w 3"]:
    """A view as its photo has it, in that one's light, its gaps filled by what is around them."""
    frame = render(scene, lit_camera(scene, camera), weight_maps=False)
    shown = fill_gaps(frame.rgb.cpu().float(), frame.alphas.cpu().float())
    return to_8bit(shown)
