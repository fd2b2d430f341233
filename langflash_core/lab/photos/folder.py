"""The one format of labelled photos, whatever data set they come from: reading and describing.

    images/ID.jpg or .png      ID: a number; neighbours in number may show the same room
    labels/ID.png              8 or 16 bits: ids of names.csv, 0 = not labelled (optional)
    names.csv                  id, name, class40 (one of the forty NYU classes; may be missing or empty)
    depths/ID.png              z in steps of `depth_unit`, 0 = unknown (optional)
    K.txt                      3 x 3, pixels of the photos as stored, the same for all (optional), or
    intrinsics.csv             id, fx, fy, cx, cy
    opinions/ID.png            what another network says, 8 bits (optional; lab/labels/opinions.py)
    poses.txt                  ID and 16 numbers, camera to world, row by row, OpenCV axes (optional)
    photos.json                {"crop": [left, top, right, bottom], "depth_unit": metres, "source": "",
                               "terms": ""}, all optional

Without `depth_unit`, 16 bits are millimetres and 8 bits have no known unit: such depths count up to
their scale. A crop takes frames off, as published pictures have them; it moves the intrinsics along.

Sizes: H W pixels of one photo after the crop.
"""

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.picture_files import opened_picture, stored_shape
from langflash_core.errors import InputError
from langflash_core.geometry.cameras import MIRRORED, invert_rigid, turned_camera
from langflash_core.images.decode import read_photo
from langflash_core.images.lens import Intrinsics
from langflash_core.lab.photos.names import CLASSES40, class_of, spoken

PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png")
MILLIMETRE = 0.001
Crop = tuple[int, int, int, int]


@dataclass(frozen=True)
class Name:
    """What an id of a folder means: the words for it, and its class of forty (None: not known)."""

    text: str
    label: str | None


@dataclass(frozen=True)
class LabelledPhoto:
    """One photo after the crop.

    image (H, W, 3) uint8; labels (H, W) int64 ids, 0 = not labelled; depths (H, W) float32, 0 = unknown;
    metric: the depths are metres; K (3, 3) pixels; pose (4, 4), camera to world; opinions (H, W) int64.
    None: not known.
    """

    id: str
    image: np.ndarray
    labels: np.ndarray | None = None
    depths: np.ndarray | None = None
    metric: bool = False
    K: Tensor | None = None
    pose: Tensor | None = None
    opinions: np.ndarray | None = None

    @property
    def intrinsics(self) -> tuple[float, float, float, float] | None:
        """(fx, fy, cx, cy) in pixels."""
        if self.K is None:
            return None
        return float(self.K[0, 0]), float(self.K[1, 1]), float(self.K[0, 2]), float(self.K[1, 2])


def lenses_of(photos: Sequence[LabelledPhoto]) -> tuple[Intrinsics, ...] | None:
    """(fx, fy, cx, cy) of each photo, pixels; None: of one of them they are not known."""
    lenses = [photo.intrinsics for photo in photos]
    known = tuple(lens for lens in lenses if lens is not None)
    return known if len(known) == len(lenses) else None


@dataclass(frozen=True)
class PhotoFolder:
    """An opened folder: ids in order of their numbers, and what is known for all of them."""

    root: Path
    ids: tuple[str, ...]
    names: dict[int, Name]
    crop: Crop | None = None
    depth_unit: float | None = None
    Ks: dict[str, Tensor] | None = None
    poses: dict[str, Tensor] | None = None

    @property
    def labelled(self) -> bool:
        return bool(self.names)

    def described(
        self,
        crop: Crop | None = None,
        intrinsics: tuple[float, float, float, float] | None = None,
        depth_unit: float | None = None,
    ) -> "PhotoFolder":
        """The folder with what somebody tells of it instead of what it says itself.

        Args:
            intrinsics: (fx, fy, cx, cy), pixels of the photos as stored. depth_unit: metres a step.
        """
        Ks = self.Ks
        if intrinsics is not None:
            Ks = dict.fromkeys(self.ids, camera_matrix(*intrinsics))
        return replace(
            self,
            crop=self.crop if crop is None else crop,
            depth_unit=self.depth_unit if depth_unit is None else depth_unit,
            Ks=Ks,
        )

    def labels(self, id: str) -> np.ndarray:
        """Ids (H, W) int64 of one photo, cropped.

        Raises:
            InputError: the map is missing, damaged, or holds an id that names.csv lacks.
        """
        ids = self.stored_labels(id)
        unknown = set(np.unique(ids).tolist()) - self.names.keys() - {0}
        if unknown:
            raise InputError(
                f"the label map of photo {id} in {self.root} holds the id {min(unknown)}, which names.csv "
                "does not list; add it there"
            )
        return _cropped(ids, self.crop, id)

    def depths(self, id: str) -> tuple[np.ndarray, bool] | None:
        """Depths (H, W) float32, cropped, 0 = unknown, and whether they are metres; None: no map.

        Raises:
            InputError: the map is damaged.
        """
        stored = self.stored_depths(id)
        return None if stored is None else (_cropped(stored[0], self.crop, id), stored[1])

    def stored_image(self, id: str) -> np.ndarray:
        """Pixels (H, W, 3) uint8 before the crop."""
        return np.asarray(read_photo(photo_path(self.root, id)).image.convert("RGB"))

    def stored_labels(self, id: str) -> np.ndarray:
        """Ids (H, W) int64 before the crop."""
        return read_map(self.root / "labels" / f"{id}.png", "label map").astype(np.int64)

    def stored_depths(self, id: str) -> tuple[np.ndarray, bool] | None:
        """As `depths`, before the crop."""
        path = self.root / "depths" / f"{id}.png"
        if not path.is_file():
            return None
        steps = read_map(path, "depth map")
        unit = self.depth_unit
        if unit is None and steps.dtype != np.uint8:
            unit = MILLIMETRE
        return steps.astype(np.float32) * (1.0 if unit is None else unit), unit is not None

    def upright_camera(self, id: str) -> tuple[Tensor | None, Tensor | None]:
        """K and pose of a photo, turned with it where EXIF turns it.

        Raises:
            InputError: it is stored mirrored.
        """
        K = None if self.Ks is None else self.Ks.get(id)
        pose = None if self.poses is None else self.poses.get(id)
        path = photo_path(self.root, id)
        if (K is None and pose is None) or not path.is_file():
            return K, pose
        with opened_picture(path) as picture:
            size, orientation = stored_shape(picture)
        if orientation == 1:
            return K, pose
        if orientation in MIRRORED:
            raise InputError(
                f"photo {id} in {self.root} is stored mirrored (EXIF orientation {orientation}), which no "
                "camera and no pose fits; save it upright, with the camera and the pose of that"
            )
        viewmat = torch.eye(4) if pose is None else invert_rigid(pose)
        turned, viewmat, _ = turned_camera(torch.eye(3) if K is None else K, viewmat, size, orientation)
        return None if K is None else turned, None if pose is None else invert_rigid(viewmat)

    def opinions(self, id: str, size: tuple[int, int]) -> np.ndarray | None:
        """What another network says of a photo, after the crop, (H, W) int64 at `size`; None: nothing.

        Raises:
            InputError: the map is damaged.
        """
        path = self.root / "opinions" / f"{id}.png"
        if not path.is_file():
            return None
        values = read_map(path, "map of opinions").astype(np.int64)
        return values[np.ix_(*(np.arange(n) * m // n for n, m in zip(size, values.shape, strict=True)))]

    def photo(self, id: str) -> LabelledPhoto:
        """Everything about one photo.

        Raises:
            ImageError: the picture cannot be used. InputError: a map cannot, or differs in size.
        """
        image = _cropped(self.stored_image(id), self.crop, id)
        labels = self.labels(id) if self.labelled else None
        depths, metric = self.depths(id) or (None, False)
        for what, found in (("label map", labels), ("depth map", depths)):
            if found is not None and found.shape != image.shape[:2]:
                raise InputError(
                    f"the {what} of photo {id} is {_size(found)} pixels, the photo {_size(image)}; "
                    "bring both to one size"
                )
        K, pose = self.upright_camera(id)
        return LabelledPhoto(
            id=id,
            image=image,
            labels=labels,
            depths=depths,
            metric=metric,
            K=K if K is None or self.crop is None else _moved(K, self.crop),
            pose=pose,
            opinions=self.opinions(id, (image.shape[0], image.shape[1])),
        )


def open_folder(root: Path) -> PhotoFolder:
    """Open a folder of the format above; photos are read later, one by one.

    Raises:
        InputError: it is missing, holds no photos, or one of its tables cannot be read.
    """
    images = root / "images"
    if not images.is_dir():
        raise InputError(
            f"there is no folder {images}; give a folder of photos as langflash lab train photos makes"
        )
    ids = sorted((p.stem for p in images.iterdir() if p.suffix.lower() in PHOTO_SUFFIXES), key=order)
    if not ids:
        raise InputError(f"{images} holds no .jpg or .png; put the photos there")
    about = _about(root / "photos.json")
    crop = about.get("crop")
    return PhotoFolder(
        root=root,
        ids=tuple(ids),
        names=_names(root / "names.csv"),
        crop=None if crop is None else (int(crop[0]), int(crop[1]), int(crop[2]), int(crop[3])),
        depth_unit=about.get("depth_unit"),
        Ks=_cameras(root, ids),
        poses=_poses(root / "poses.txt"),
    )


def order(id: str) -> tuple[int, str]:
    """Numbers in order, then the rest by name."""
    return (int(id), "") if id.isdigit() else (2**62, id)


def photo_path(root: Path, id: str) -> Path:
    """The picture of an id; the first suffix that is there."""
    for suffix in PHOTO_SUFFIXES:
        for spelling in (suffix, suffix.upper()):
            path = root / "images" / f"{id}{spelling}"
            if path.is_file():
                return path
    return root / "images" / f"{id}.jpg"


def camera_matrix(fx: float, fy: float, cx: float, cy: float) -> Tensor:
    """K (3, 3) float32."""
    return torch.tensor([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]], dtype=torch.float32)


def _moved(K: Tensor, crop: Crop) -> Tensor:
    moved = K.clone()
    moved[0, 2] -= crop[0]
    moved[1, 2] -= crop[1]
    return moved


def _cropped(values: np.ndarray, crop: Crop | None, id: str) -> np.ndarray:
    if crop is None:
        return values
    left, top, right, bottom = crop
    if not (0 <= left < right <= values.shape[1] and 0 <= top < bottom <= values.shape[0]):
        raise InputError(
            f"the crop {left},{top},{right},{bottom} does not fit into photo {id} ({_size(values)} pixels); "
            "give LEFT,TOP,RIGHT,BOTTOM inside it"
        )
    return values[top:bottom, left:right]


def _size(values: np.ndarray) -> str:
    return f"{values.shape[1]} x {values.shape[0]}"


def read_map(path: Path, what: str) -> np.ndarray:
    """(H, W) uint8 or uint16."""
    try:
        with opened_picture(path) as opened:
            if opened.mode not in ("L", "P", "I", "I;16", "I;16B"):
                raise ValueError(f"mode {opened.mode}")
            values = np.asarray(opened)
    except FileNotFoundError:
        raise InputError(f"there is no {what} {path}; every photo of the folder needs one") from None
    except (OSError, ValueError, SyntaxError) as error:
        raise InputError(f"{path} is no {what} ({error}); use a .png of one channel") from None
    return values if values.dtype == np.uint8 else values.astype(np.uint16)


def _about(path: Path) -> dict:
    """photos.json, checked; {} where there is none."""
    if not path.is_file():
        return {}
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(about, dict):
            raise ValueError("it is no object")
        crop, unit = about.get("crop"), about.get("depth_unit")
        if crop is not None and not (len(crop) == 4 and all(isinstance(side, int) for side in crop)):
            raise ValueError("crop needs four whole numbers")
        if unit is not None and not (isinstance(unit, int | float) and unit > 0 and math.isfinite(unit)):
            raise ValueError("depth_unit needs a number above 0")
    except (ValueError, TypeError, OSError) as error:
        raise InputError(f"{path} cannot be used: {error}; correct or remove it") from None
    return about


def _names(path: Path) -> dict[int, Name]:
    """names.csv; {} where there is none."""
    if not path.is_file():
        return {}
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream))
        return {
            int(row["id"]): _name(row["name"], row.get("class40") or "") for row in rows if int(row["id"])
        }
    except (KeyError, ValueError, TypeError, OSError, csv.Error) as error:
        raise InputError(f"{path} cannot be used ({error!r}); it needs the columns id and name") from None


def _name(name: str, label: str) -> Name:
    if not label:
        return Name(spoken(name), class_of(name))
    if spoken(label) not in CLASSES40:
        raise ValueError(f"class40 {label!r} of {name!r}")
    return Name(spoken(name), spoken(label))


def _cameras(root: Path, ids: Sequence[str]) -> dict[str, Tensor] | None:
    """K of every id from intrinsics.csv, else the one of K.txt."""
    table, shared = root / "intrinsics.csv", root / "K.txt"
    try:
        if table.is_file():
            with table.open(encoding="utf-8", newline="") as stream:
                rows = list(csv.DictReader(stream))
            return {
                row["id"]: camera_matrix(*(float(row[name]) for name in ("fx", "fy", "cx", "cy")))
                for row in rows
            }
        if not shared.is_file():
            return None
        values = np.loadtxt(shared, dtype=np.float64).reshape(3, 3)
    except (KeyError, ValueError, TypeError, OSError, csv.Error) as error:
        path = table if table.is_file() else shared
        raise InputError(f"{path} holds no intrinsics ({error!r}); correct or remove it") from None
    return dict.fromkeys(ids, camera_matrix(values[0, 0], values[1, 1], values[0, 2], values[1, 2]))


def _poses(path: Path) -> dict[str, Tensor] | None:
    if not path.is_file():
        return None
    poses = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if not words:
            continue
        try:
            values = torch.tensor([float(word) for word in words[1:]], dtype=torch.float64).reshape(4, 4)
        except (ValueError, RuntimeError):
            raise InputError(
                f"{path} has a line that is not an id and 16 numbers: {line[:60]!r}; correct it"
            ) from None
        poses[words[0]] = values
    return poses
