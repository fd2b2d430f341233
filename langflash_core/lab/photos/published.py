"""Published data sets read where they lie: each opens as a `PhotoFolder`, a scene or the whole of it.

What `layouts` converts, these leave as it was unpacked: nothing is written, nothing that was read is
executed. A labelled id is one of `names`; 0 is not labelled.
"""

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
import torch
from PIL import Image, UnidentifiedImageError
from torch import Tensor

from langflash_core.base.picture_files import opened_picture
from langflash_core.errors import InputError
from langflash_core.images.decode import read_photo
from langflash_core.lab.photos.folder import MILLIMETRE, Name, PhotoFolder, camera_matrix, order, read_map
from langflash_core.lab.photos.matlab import MatFile, open_mat
from langflash_core.lab.photos.names import CLASSES40, class_of, spoken
from langflash_core.lab.photos.reading import read_table

NYU_FRAME = (41, 45, 601, 471)
"""The usual crop of the 640 x 480 pictures, which have a white frame: left, top, right, bottom."""
NYU_CAMERA = (518.8579, 519.4696, 325.5824, 253.7362)
"""fx, fy, cx, cy of the colour camera, from the data set's toolbox."""
KINECT_CAMERA = (585.0, 585.0, 320.0, 240.0)
"""fx, fy, cx, cy that 7-Scenes publishes for its 640 x 480 frames."""
SCANNET_NAMES = "scannetv2-labels.combined.tsv"
NO_DEPTH = 65_535
"""What 7-Scenes writes where the sensor saw nothing."""
RE10K_NUMBERS = 18
"""Of a camera: fx, fy, cx, cy in widths and heights, two zeros, and world to camera (3, 4) row by row."""


@dataclass(frozen=True)
class NyuFile(PhotoFolder):
    """nyu_depth_v2_labeled.mat; photos are numbered from 0001 as in the file."""

    mat: MatFile = field(default=None)  # type: ignore[assignment]

    def stored_image(self, id: str) -> np.ndarray:
        return np.ascontiguousarray(self.mat.item("images", int(id) - 1))

    def stored_labels(self, id: str) -> np.ndarray:
        return self.mat.item("labels", int(id) - 1).astype(np.int64)

    def stored_depths(self, id: str) -> tuple[np.ndarray, bool] | None:
        return np.nan_to_num(self.mat.item("depths", int(id) - 1)).astype(np.float32), True


def open_nyu(path: Path, split: str | None = "testNdxs") -> NyuFile:
    """The labelled NYU Depth v2; splits.mat and classMapping40.mat beside it are used if they are there.

    Args:
        split: key of splits.mat; None: all photos.

    Raises:
        InputError: the file cannot be read. MissingPackageError: h5py is not installed.

    Source: Silberman, Hoiem, Kohli, Fergus, ECCV 2012.
    """
    mat = open_mat(path)
    splits, mapping = path.parent / "splits.mat", path.parent / "classMapping40.mat"
    numbers = list(range(1, mat.count("images") + 1))
    if split is not None and splits.is_file():
        numbers = sorted(int(n) for n in open_mat(splits).array(split).ravel())
    texts = mat.texts("names")
    published = forty_classes(mapping if mapping.is_file() else None, len(texts))
    labels = [spoken(c) if c else class_of(t) for t, c in zip(texts, published, strict=True)]
    names = {
        n: Name(spoken(text), label)
        for n, (text, label) in enumerate(zip(texts, labels, strict=True), start=1)
    }
    ids = tuple(f"{n:04d}" for n in numbers)
    Ks = dict.fromkeys(ids, camera_matrix(*NYU_CAMERA))
    return NyuFile(root=path, ids=ids, names=names, crop=NYU_FRAME, Ks=Ks, mat=mat)


def forty_classes(path: Path | None, count: int) -> list[str | None]:
    """Class of every name by classMapping40.mat; None of each without that file."""
    if path is None:
        return [None] * count
    mat: MatFile = open_mat(path)
    classes, rows = mat.texts("className"), mat.array("mapClass").ravel().astype(int).tolist()
    if len(rows) != count:
        raise InputError(f"{path} maps {len(rows)} names, the labels have {count}; use files of one release")
    return [classes[row - 1] if row else None for row in rows]


@dataclass(frozen=True)
class FrameFolder(PhotoFolder):
    """frame-N.color.png, frame-N.depth.png (mm), frame-N.pose.txt, as 7-Scenes has them."""

    def colour(self, id: str) -> Path:
        """The photo's file."""
        return _first(self.root, f"frame-{id}.color", (".png", ".jpg"))

    def stored_image(self, id: str) -> np.ndarray:
        return _pixels(self.colour(id))

    def stored_depths(self, id: str) -> tuple[np.ndarray, bool] | None:
        path = self.root / f"frame-{id}.depth.png"
        if not path.is_file():
            return None
        steps = read_map(path, "depth map")
        return np.where(steps == NO_DEPTH, 0, steps).astype(np.float32) * MILLIMETRE, True


def open_frames(root: Path) -> FrameFolder:
    """One sequence of posed RGB-D frames; frames whose pose is not finite are left out.

    Raises:
        InputError: there are no frames, or a pose cannot be read.

    Source: Shotton et al., Scene Coordinate Regression Forests, CVPR 2013.
    """
    colours = [*root.glob("frame-*.color.png"), *root.glob("frame-*.color.jpg")]
    poses = {}
    for path in colours:
        id = path.name.split(".")[0].removeprefix("frame-")
        pose = _matrix(root / f"frame-{id}.pose.txt")
        if bool(pose.isfinite().all()):
            poses[id] = pose
    ids = tuple(sorted(poses, key=order))
    if not ids:
        raise InputError(f"{root} holds no frame-N.color.png with its pose; give a sequence, as seq-01")
    Ks = dict.fromkeys(ids, camera_matrix(*KINECT_CAMERA))
    return FrameFolder(root=root, ids=ids, names={}, Ks=Ks, poses=poses)


@dataclass(frozen=True)
class ScanNetScene(PhotoFolder):
    """A scene as `SensReader` extracts it (color, depth, pose, intrinsic, label-filt), or of the test set of
    LSM (images with .npz, depths, labels). Maps of another size take the photo's, by nearest values."""

    def stored_image(self, id: str) -> np.ndarray:
        return _pixels(_first(self._folder("images", "color"), id, (".jpg", ".png")))

    def stored_labels(self, id: str) -> np.ndarray:
        folder = self._folder("labels", "label-filt", "label")
        return self._sized(id, read_map(folder / f"{id}.png", "label map").astype(np.int32)).astype(np.int64)

    def stored_depths(self, id: str) -> tuple[np.ndarray, bool] | None:
        path = self._folder("depths", "depth") / f"{id}.png"
        if not path.is_file():
            return None
        steps = self._sized(id, read_map(path, "depth map").astype(np.int32))
        return steps.astype(np.float32) * MILLIMETRE, True

    def _folder(self, *names: str) -> Path:
        return next((self.root / name for name in names if (self.root / name).is_dir()), self.root / names[0])

    def _sized(self, id: str, values: np.ndarray) -> np.ndarray:
        return _resized(values, _size(_first(self._folder("images", "color"), id, (".jpg", ".png"))))


def scannet_names(root: Path) -> dict[int, Name]:
    """What ids of ScanNet mean, with their class of forty, from its table of labels.

    Raises:
        InputError: the table is missing or has no such columns.
    """
    path = root / SCANNET_NAMES
    if not path.is_file():
        raise InputError(f"there is no {path}; it comes with ScanNet, put it beside the scenes")
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            rows = list(csv.DictReader(stream, delimiter="\t"))
        names = {}
        for row in rows:
            label = spoken(row["nyu40class"])
            names[int(row["id"])] = Name(spoken(row["raw_category"]), label if label in CLASSES40 else None)
        return names
    except (KeyError, ValueError, TypeError, OSError, csv.Error) as error:
        raise InputError(f"{path} cannot be used ({error!r}); copy it again from ScanNet") from None


def open_scannet(root: Path, names: Mapping[int, Name]) -> ScanNetScene:
    """One scene; photos whose pose is not finite are left out.

    Raises:
        InputError: there are no photos, or a camera cannot be read.

    Source: Dai et al., ScanNet, CVPR 2017; Fan et al., Large Spatial Model, NeurIPS 2024.
    """
    packed = (root / "images").is_dir()
    folder = root / ("images" if packed else "color")
    found = sorted({p.stem for p in folder.glob("*.[jp][pn]g")}, key=order)
    Ks: dict[str, Tensor] = {}
    poses: dict[str, Tensor] = {}
    shared = None if packed else _camera(root / "intrinsic" / "intrinsic_color.txt")
    for id in found:
        if shared is None:
            K, pose = _packed_camera(folder / f"{id}.npz")
        else:
            K, pose = shared, _matrix(root / "pose" / f"{id}.txt")
        if bool(pose.isfinite().all()):
            Ks[id], poses[id] = K, pose
    if not poses:
        raise InputError(f"{root} holds no posed photo in images/ or color/; extract the scene again")
    return ScanNetScene(root=root, ids=tuple(poses), names=dict(names), Ks=Ks, poses=poses)


@dataclass(frozen=True)
class Re10kScene(PhotoFolder):
    """Frames of one video of RealEstate10K, held as the JPEG bytes of their chunk.

    maps: of videos whose things were collected, PNG bytes of each frame's numbers, 0 = nobody; vectors: of
    the things, (M, C), row n of thing n + 1.
    """

    frames: Mapping[str, bytes] = field(default_factory=dict)
    maps: Mapping[str, bytes] = field(default_factory=dict)
    vectors: Tensor | None = None

    @property
    def labelled(self) -> bool:
        return bool(self.maps)

    def labels(self, id: str) -> np.ndarray:
        """Numbers (H, W) of the things in a frame, as it was labelled: at the frame's size."""
        ids = _decoded_map(self.maps[id], f"labels of frame {id} of {self.root.name}")
        height, width = self.stored_image(id).shape[:2]
        return _resized(ids.astype(np.int32), (width, height)).astype(np.int64)

    def stored_image(self, id: str) -> np.ndarray:
        return _decoded(self.frames[id], f"frame {id} of {self.root.name}")

    def stored_depths(self, id: str) -> tuple[np.ndarray, bool] | None:
        return None


def re10k_scenes(root: Path, keys: Mapping[str, object] | None = None) -> Iterator[tuple[str, Re10kScene]]:
    """Scenes of a split as pixelSplat keeps it: index.json (key -> chunk) and chunks NNNNNN.torch, each a
    list of {"key", "cameras" (V, 18), "images": JPEG bytes as uint8 tensors}.

    Chunks are unpacked by torch's reader of tensors alone: code in them is refused, not run.

    Args:
        keys: only these.

    Raises:
        InputError: index or chunk cannot be used.

    Source: Zhou et al., Stereo Magnification, SIGGRAPH 2018; Charatan et al., pixelSplat, CVPR 2024.
    """
    index = read_table(root / "index.json")
    wanted = {key: chunk for key, chunk in index.items() if keys is None or key in keys}
    for chunk in sorted(set(wanted.values())):
        for entry in read_chunk(root / str(chunk)):
            key = str(entry["key"])
            if key in wanted:
                scene = _re10k(root / key, entry["cameras"], entry["images"])
                yield key, _collected(scene, entry["labels"]) if "labels" in entry else scene


def _collected(scene: Re10kScene, entry: Mapping) -> Re10kScene:
    """A video with what was collected of it: {"ids": PNG bytes as uint8 tensors, "vectors": (M, C)}."""
    try:
        maps = [stream.numpy().tobytes() for stream in entry["ids"]]
        vectors = entry["vectors"].float()
        if len(maps) != len(scene.ids) or vectors.ndim != 2:
            raise ValueError(f"{len(maps)} maps of {len(scene.ids)} frames")
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"the labels of {scene.root.name} cannot be read ({error!r}); collect them again"
        ) from None
    return replace(scene, maps=dict(zip(scene.ids, maps, strict=True)), vectors=vectors)


def _re10k(root: Path, cameras: Tensor, images: list[Tensor]) -> Re10kScene:
    frames = {f"{n:06d}": image.numpy().tobytes() for n, image in enumerate(images)}
    if not frames or tuple(cameras.shape) != (len(frames), RE10K_NUMBERS):
        raise InputError(
            f"{root.name} has {len(frames)} frames and cameras {tuple(cameras.shape)}; get it again"
        )
    height, width = _decoded(images[0].numpy().tobytes(), root.name).shape[:2]
    Ks, poses = _re10k_cameras(list(frames), cameras, width, height)
    return Re10kScene(root=root, ids=tuple(frames), names={}, frames=frames, Ks=Ks, poses=poses)


def _re10k_cameras(
    ids: list[str], cameras: Tensor, width: int, height: int
) -> tuple[dict[str, Tensor], dict[str, Tensor]]:
    """Ks and poses of cameras (V, 18)."""
    Ks, poses = {}, {}
    for id, row in zip(ids, cameras.double(), strict=True):
        fx, fy, cx, cy = row[:4].tolist()
        Ks[id] = camera_matrix(fx * width, fy * height, cx * width, cy * height)
        viewmat = torch.eye(4, dtype=torch.float64)
        viewmat[:3] = row[6:].reshape(3, 4)
        poses[id] = torch.linalg.inv(viewmat)
    return Ks, poses


@dataclass(frozen=True)
class MaskedScene(PhotoFolder):
    """images/ and, of some, segmentations/NN/CLASS.png, as 3D-OVS has them; `annotated`: id -> folder."""

    files: Mapping[str, Path] = field(default_factory=dict)
    annotated: Mapping[str, Path] = field(default_factory=dict)

    def stored_image(self, id: str) -> np.ndarray:
        return _pixels(self.files[id])

    def stored_labels(self, id: str) -> np.ndarray:
        """The class whose mask holds a pixel, the first in order of names; 0 where none does, and of photos
        without masks. Masks of another size take the photo's."""
        size = _size(self.files[id])
        ids = np.zeros((size[1], size[0]), dtype=np.int64)
        if id not in self.annotated:
            return ids
        for number, name in sorted(self.names.items(), reverse=True):
            path = self.annotated[id] / f"{name.text}.png"
            try:
                with opened_picture(path) as opened:
                    mask = np.asarray(opened.convert("L").resize(size, Image.Resampling.NEAREST)) > 127
            except OSError as error:
                raise InputError(f"the mask {path} cannot be read ({error}); unpack the data again") from None
            ids[mask] = number
        return ids

    def stored_depths(self, id: str) -> tuple[np.ndarray, bool] | None:
        return None


def open_masked(root: Path) -> MaskedScene:
    """One scene of 3D-OVS, or photos annotated in its manner: segmentations/classes.txt and a folder per
    annotated photo, called by its name or its place in order. cameras.pt of RealEstate10K, if it is there,
    gives poses.

    Raises:
        InputError: photos, classes or masks are missing.

    Source: Liu et al., Weakly Supervised 3D Open-vocabulary Segmentation, NeurIPS 2023.
    """
    images = root / "images"
    files = {p.stem: p for p in sorted(images.glob("*")) if p.suffix.lower() in (".jpg", ".jpeg", ".png")}
    table = root / "segmentations" / "classes.txt"
    if not files or not table.is_file():
        missing = table if files else images
        raise InputError(f"there is no {missing}; give a scene as unpacked, with images and segmentations")
    texts = sorted({line.strip() for line in table.read_text(encoding="utf-8").splitlines() if line.strip()})
    folders = sorted(p for p in (root / "segmentations").iterdir() if p.is_dir())
    ids, annotated = list(files), {}
    for folder in folders:
        if folder.name in files:
            annotated[folder.name] = folder
        elif folder.name.isdigit() and int(folder.name) < len(ids):
            annotated[ids[int(folder.name)]] = folder
        else:
            raise InputError(f"{folder} belongs to none of the {len(ids)} photos; unpack the scene again")
    names = {n: Name(text, class_of(text)) for n, text in enumerate(texts, start=1)}
    Ks = poses = None
    if (root / "cameras.pt").is_file():
        stored = _tensors(root / "cameras.pt")
        if not isinstance(stored, Tensor) or tuple(stored.shape) != (len(ids), RE10K_NUMBERS):
            raise InputError(f"{root / 'cameras.pt'} does not hold a camera per photo; get it again")
        Ks, poses = _re10k_cameras(ids, stored, *_size(files[ids[0]]))
    return MaskedScene(
        root=root, ids=tuple(ids), names=names, Ks=Ks, poses=poses, files=files, annotated=annotated
    )


def read_chunk(path: Path) -> list[dict]:
    """The videos of one chunk as they are stored: each a table with key, cameras, images and more.

    Raises:
        InputError: it cannot be read without running code, or is something else.
    """
    entries = _tensors(path)
    whole = isinstance(entries, list) and all(
        isinstance(e, dict) and {"key", "cameras", "images"} <= e.keys() for e in entries
    )
    if not whole:
        raise InputError(f"{path} is no chunk of scenes; get it again")
    return entries  # type: ignore[return-value]


def _tensors(path: Path) -> object:
    """What torch.save wrote, tensors and plain containers only."""
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except FileNotFoundError:
        raise InputError(f"there is no {path}, which the data set lists; get it again") from None
    except Exception as error:  # torch's many: damaged archives, refused code
        raise InputError(f"{path} cannot be read safely ({type(error).__name__}); get it again") from None


def _first(folder: Path, stem: str, suffixes: tuple[str, ...]) -> Path:
    return next(
        (folder / f"{stem}{s}" for s in suffixes if (folder / f"{stem}{s}").is_file()),
        folder / f"{stem}{suffixes[0]}",
    )


def _pixels(path: Path) -> np.ndarray:
    return np.asarray(read_photo(path).image.convert("RGB"))


def _size(path: Path) -> tuple[int, int]:
    """(width, height) of a photo."""
    with opened_picture(path) as photo:
        return photo.size


def _resized(values: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """A map at (width, height), by nearest values."""
    if (values.shape[1], values.shape[0]) == size:
        return values
    return np.asarray(Image.fromarray(values).resize(size, Image.Resampling.NEAREST))


def _decoded(content: bytes, what: str) -> np.ndarray:
    try:
        with opened_picture(content) as opened:
            return np.asarray(opened.convert("RGB"))
    except (UnidentifiedImageError, OSError) as error:
        raise InputError(f"{what} is no picture ({error}); get the chunk again") from None


def _decoded_map(content: bytes, what: str) -> np.ndarray:
    """(H, W) int64 of a PNG of one channel."""
    try:
        with opened_picture(content) as opened:
            return np.asarray(opened).astype(np.int64)
    except (OSError, ValueError) as error:
        raise InputError(f"the {what} cannot be read ({error}); collect them again") from None


def _matrix(path: Path) -> Tensor:
    """(4, 4) float64 of a text file, as it is, finite or not."""
    try:
        return torch.from_numpy(np.loadtxt(path, dtype=np.float64).reshape(4, 4))
    except (OSError, ValueError) as error:
        raise InputError(f"{path} holds no pose ({error}); unpack the data set again") from None


def _camera(path: Path) -> Tensor:
    """K (3, 3) of an intrinsic matrix."""
    values = _matrix(path)
    return camera_matrix(*(float(values[row, column]) for row, column in ((0, 0), (1, 1), (0, 2), (1, 2))))


def _packed_camera(path: Path) -> tuple[Tensor, Tensor]:
    """K and pose of an .npz with camera_intrinsics and camera_pose."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            K, pose = stored["camera_intrinsics"], stored["camera_pose"]
        return (
            camera_matrix(float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2])),
            torch.from_numpy(pose.astype(np.float64).reshape(4, 4)),
        )
    except (OSError, KeyError, ValueError, IndexError, BadZipFile) as error:
        raise InputError(f"{path} holds no camera ({error}); unpack the data set again") from None
