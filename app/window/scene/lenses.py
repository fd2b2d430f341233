"""The lenses of photos in the tray, as the scene on show has found them."""

import math
from collections.abc import Mapping
from pathlib import Path

from langflash_core.base.records import FoundLens, Record
from langflash_core.geometry.poses import Pose
from langflash_core.images.still_names import shown_name

from .state import Photo, SceneInfo

ASSUMED_FOV = 65.0  # degrees, as the core assumes where neither file nor person says
_SAME_SAID = 0.05  # degrees between what the file says and what the record says of it
_SAME_FOCAL = 0.02  # of a focal length; a thumbnail's sides are whole pixels


def told_lenses(record: Record) -> tuple[FoundLens, ...]:
    """What photos told; nothing where a file of another version says it otherwise."""
    try:
        lenses = tuple(FoundLens(**lens) for lens in record.lens.get("found", ()))
    except TypeError:
        return ()
    known = all(isinstance(value, int | float) for lens in lenses for value in vars(lens).values())
    return lenses if known else ()


def places(info: SceneInfo | None) -> dict[str, int]:
    """Views by the names of their photos; none where no lens was found."""
    return {name: view for view, name in enumerate(info.scene.record.photos)} if info and info.lenses else {}


def found_lens(
    info: SceneInfo | None, places: Mapping[str, int], photo: Photo, aspect: float
) -> FoundLens | None:
    """The lens that took a photo, where the scene found it.

    The record says what each lens was taken for before; of several that were taken for the same, the photo's
    own is the one of the focal length that its view has now.

    Args:
        places: as above. aspect: of the photo, width over height.
    """
    view = places.get(_plain(photo.path), places.get(f"{photo.path.parent.name}/{_plain(photo.path)}"))
    if info is None or view is None or view >= len(info.views):
        return None
    said, half = photo.recorded or ASSUMED_FOV, _half(info.views[view], aspect)
    for lens in info.lenses:
        same = lens.recorded is bool(photo.recorded) and abs(lens.said - said) < _SAME_SAID
        # A view whose lens bent lines is a part of the photo, straightened: its focal length is another.
        if same and (lens.bend or abs(math.tan(math.radians(lens.fov) / 2) / half - 1) < _SAME_FOCAL):
            return lens
    return None


def _plain(path: Path) -> str:
    return shown_name(path.name)


def _half(view: Pose, aspect: float) -> float:
    """Half of a photo's longer side over its focal length: its view is the largest box of the view's shape
    in its middle."""
    focal = max(view.aspect, 1.0) / (2 * math.tan(math.radians(view.fov) / 2))  # in heights of the view
    height = min(1.0, aspect / view.aspect)  # of the view, in heights of the photo
    return max(aspect, 1.0) / (2 * focal * height)
