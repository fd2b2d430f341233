"""Cameras and photos as COLMAP's model and as transforms.json, out and in.

COLMAP: cameras.txt (intrinsics), images.txt (quaternion wxyz and translation, world to camera, OpenCV axes,
one line each and one, here empty, of points), points3D.txt (where trainers of splats begin: some of the
scene's Gaussians, sRGB, without tracks); `langflash_core/export/colmap.py` reads them. transforms.json
(instant-ngp, nerfstudio): camera to world, OpenGL axes (right, up, back), one frame a photo, intrinsics of
all or of each. The photos lie in images/ beside the text. The centre of the top-left pixel is (0.5, 0.5).

Source: COLMAP's documentation (output format); nerfstudio's (data conventions).
"""

import json
import math
import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import torch
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.limits import VIEWS
from langflash_core.base.picture_files import STORED, opened_picture, stored_shape
from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export.colmap import check_pinhole, pinhole, read_model, text_lines
from langflash_core.export.packing import error_line
from langflash_core.export.settings import POINT_CLOUD
from langflash_core.geometry.cameras import MIRRORED, invert_rigid, turned_camera
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.geometry.quaternions import matrices_to_quats
from langflash_core.types import Scene

COLMAP, TRANSFORMS = "cameras.txt", "transforms.json"
_BINARY = "cameras.bin"
_IMAGES = "images"
_FLIP = torch.diag(torch.tensor([1.0, -1.0, -1.0, 1.0], dtype=torch.float64))  # OpenGL axes and OpenCV's
_BENDS = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "s1", "s2", "s3", "s4")
_OTHER_LENSES = ("is_fisheye", "fisheye", "equirectangular", "latlong", "orthographic", "ftheta_p0")
"""What says in a transforms.json that a lens is no pinhole, whatever its numbers are."""
_DAMAGE = (ValueError, LookupError, TypeError, AttributeError, RecursionError, OverflowError, RuntimeError,
           struct.error)  # fmt: skip
_REMEDY = "export it again as COLMAP text or transforms.json, of undistorted photos"


@dataclass(frozen=True)
class PosedPhotos:
    """V photos with their lenses and places.

    paths: files, which may be missing. viewmats (V, 4, 4) float64, world to camera, OpenCV axes, in the
    world's own unit. Ks (V, 3, 3) float64 in pixels of photos of sizes (V) (width, height), as stored.
    folder: from which on the photos' paths tell them apart.
    """

    paths: tuple[Path, ...]
    viewmats: Tensor
    Ks: Tensor
    sizes: tuple[tuple[int, int], ...]
    folder: Path

    @property
    def names(self) -> tuple[str, ...]:
        """Paths below the folder."""
        inside = (p.relative_to(self.folder) if p.is_relative_to(self.folder) else p for p in self.paths)
        return tuple(path.as_posix() for path in inside)

    @property
    def intrinsics(self) -> tuple[tuple[float, float, float, float], ...]:
        """(fx, fy, cx, cy) of each photo, pixels."""
        return tuple((float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2])) for K in self.Ks)

    def of(self, photos: Sequence[Path]) -> "PosedPhotos":
        """Only these photos, in their order; all, where none is named. They are told by their paths below the
        folder, elsewhere by as much of their path as a pose has, or by a file's name that is there once.

        Raises:
            SceneFileError: a photo has no pose or several, or two photos have one.
        """
        if not photos:
            return self
        there = any(path.is_file() for path in self.paths)
        rows = [self._row(photo, there) for photo in photos]
        owners: dict[int, Path] = {}
        for row, photo in zip(rows, photos, strict=True):
            other = owners.setdefault(row, photo)
            if other.resolve() != photo.resolve():
                raise SceneFileError(
                    f"{_told_path(other)} and {_told_path(photo)} would both take the pose of "
                    f"{self.names[row]}; keep photos in the folders that the poses name"
                )
        return replace(self.at(rows), paths=tuple(photos))

    def at(self, rows: Sequence[int]) -> "PosedPhotos":
        """Only some, by their places."""
        rows = list(rows)
        paths, sizes = (tuple(values[row] for row in rows) for values in (self.paths, self.sizes))
        return replace(self, paths=paths, viewmats=self.viewmats[rows], Ks=self.Ks[rows], sizes=sizes)

    def upright(self) -> "PosedPhotos":
        """The same for the photos as they lie there, turned upright: they may be smaller than those that the
        poses were found from, and EXIF may turn them, which programs that find poses leave aside.

        Raises:
            SceneFileError: a photo is missing or no picture, of another shape than its pose, or mirrored.
        """
        found = []
        for path, K, viewmat, said in zip(self.paths, self.Ks, self.viewmats, self.sizes, strict=True):
            (width, height), orientation = _shape(path)
            size = width, height
            if not _same_shape(size, said) and orientation >= 5 and _same_shape((height, width), said):
                size, orientation = (height, width), 1  # poses of the upright photo
            if not _same_shape(size, said):
                raise SceneFileError(
                    f"{path.name} is {width} x {height} pixels, its pose is of {said[0]} x {said[1]}; "
                    "give the photos that the poses were found from, at any size"
                )
            if orientation in MIRRORED:
                raise SceneFileError(
                    f"{path.name} is stored mirrored (EXIF orientation {orientation}), so its pose is of a "
                    "mirrored room; save it upright and seek the poses again"
                )
            own = K * torch.tensor([size[0] / said[0], size[1] / said[1], 1], dtype=K.dtype)[:, None]
            found.append(turned_camera(own, viewmat, size, orientation))
        Ks, viewmats, sizes = zip(*found, strict=True)
        return replace(self, viewmats=torch.stack(viewmats), Ks=torch.stack(Ks), sizes=sizes)

    def _row(self, photo: Path, there: bool) -> int:
        """Which pose is a photo's. there: the folder holds photos of these poses, so its others have none."""
        own, names = photo.resolve(), [PurePosixPath(name).parts for name in self.names]
        folder = self.folder.resolve()
        alike = [row for row, parts in enumerate(names) if parts[-1:] == (photo.name,)]
        if there and own.is_relative_to(folder):
            fitting = [row for row, parts in enumerate(names) if parts == own.relative_to(folder).parts]
        else:
            whole = Path(os.path.abspath(photo)).parts
            ends = [len(parts) if whole[-len(parts) :] == parts else 0 for parts in names]
            fitting = [row for row, length in enumerate(ends) if length and length == max(ends)]
            fitting = fitting or alike
        if not fitting:
            told = _told_path(photo) if alike else photo.name
            raise SceneFileError(f"there is no pose of {told}; name photos that the poses are of")
        if len(fitting) > 1:
            first, second = (self.names[row] for row in fitting[:2])
            raise SceneFileError(
                f"the pose of {_told_path(photo)} may be that of {first} or of {second}; "
                "keep photos in the folders that the poses name, and each there once"
            )
        return fitting[0]


def write_colmap(scene: Scene, path: Path) -> None:
    """cameras.txt, images.txt and points3D.txt in the folder of `path`, photos in its images/.

    Raises:
        OutputError: the scene has no photos, or the folder cannot be written.
    """
    names, sizes = _write_photos(scene, path)
    lenses = ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, fx, fy, cx, cy"]
    places = ["# IMAGE_ID, qvec, tvec, CAMERA_ID, NAME"]
    for view, (name, (width, height)) in enumerate(zip(names, sizes, strict=True)):
        K = scene.camera(view, width, height).K.double()
        numbers = (K[0, 0], K[1, 1], K[0, 2], K[1, 2])
        lenses.append(f"{view + 1} PINHOLE {width} {height} {_format_numbers(numbers)}")
        viewmat = scene.viewmats[view].double().cpu()
        pose = f"{_format_numbers(matrices_to_quats(viewmat[:3, :3]))} {_format_numbers(viewmat[:3, 3])}"
        places += [f"{view + 1} {pose} {view + 1} {name}", ""]
    for name, lines in (
        ("points3D.txt", ["# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]", *_points(scene)]),
        ("images.txt", places),
        (COLMAP, lenses),
    ):
        write_atomically(path.with_name(name), ("\n".join(lines) + "\n").encode())


def write_transforms(scene: Scene, path: Path) -> None:
    """A transforms.json, and the photos in images/ beside it.

    Raises:
        OutputError: the scene has no photos, or the folder cannot be written.
    """
    names, sizes = _write_photos(scene, path)
    frames = []
    for view, (name, (width, height)) in enumerate(zip(names, sizes, strict=True)):
        K = scene.camera(view, width, height).K.double()
        pose = invert_rigid(scene.viewmats[view].double().cpu()) @ _FLIP
        frames.append(
            {
                "file_path": f"{_IMAGES}/{name}",
                "w": width, "h": height,
                "fl_x": float(K[0, 0]), "fl_y": float(K[1, 1]), "cx": float(K[0, 2]), "cy": float(K[1, 2]),
                "transform_matrix": pose.tolist(),
            }
        )  # fmt: skip
    straight = dict.fromkeys(("k1", "k2", "p1", "p2"), 0.0)  # some readers take no other model than OPENCV
    document = {"camera_model": "OPENCV", **straight, "frames": frames}
    write_atomically(path, json.dumps(document, indent=1).encode())


def read_posed(path: Path) -> PosedPhotos:
    """Photos and poses of a transforms.json, or of COLMAP's model, text or binary, in a folder or by a file.

    Raises:
        SceneFileError: missing, damaged, or of lenses that bend straight lines.
    """
    try:
        if path.is_dir():
            places = (path, path / "sparse" / "0", path / "sparse")
            known = [path / TRANSFORMS, *(p / name for p in places for name in (COLMAP, _BINARY))]
            path = next((file for file in known if file.is_file()), path / COLMAP)
        posed = _transforms(path) if path.suffix.lower() == ".json" else _colmap(path)
        VIEWS.check(len(posed.paths), path.name, SceneFileError)
        _check(posed)
        return posed
    except FileNotFoundError as error:
        missing = Path(error.filename or path).name
        raise SceneFileError(f"there is no {missing} where {path} is looked for; check the path") from error
    except OSError as error:
        raise SceneFileError(f"{path} cannot be read ({error.strerror}); check its permissions") from error
    except _DAMAGE as error:
        said = error_line(error)
        raise SceneFileError(f"{path.name} does not hold posed photos ({said}); {_REMEDY}") from error


def _write_photos(scene: Scene, path: Path) -> tuple[list[str], list[tuple[int, int]]]:
    """Names and sizes of the photos, which lie in images/ afterwards."""
    if not scene.photos:
        raise OutputError(f"cannot write {path.name}: the scene has no photos; reconstruct it from photos")
    make_folder(path.parent / _IMAGES)
    names, sizes = [], []
    for number, photo in enumerate(scene.photos, start=1):
        names.append(f"{number:03d}.jpg")
        try:
            with opened_picture(photo, STORED) as picture:
                sizes.append(picture.size)
        except (OSError, SyntaxError, ValueError) as error:
            why = f"a photo in the scene is damaged ({error_line(error)}); reconstruct it from photos"
            raise OutputError(f"cannot write {path.name}: {why}") from error
        write_atomically(path.parent / _IMAGES / names[-1], photo)
    return names, sizes


def _points(scene: Scene) -> list[str]:
    """Lines of points3D.txt: at most `POINT_CLOUD.most_points` Gaussians that are seen, evenly chosen."""
    gaussians = scene.gaussians
    solid = gaussians.means.isfinite().all(-1) & (gaussians.opacities >= POINT_CLOUD.solid)
    rows = solid.nonzero()[:, 0]
    rows = rows[:: max(1, -(-len(rows) // POINT_CLOUD.most_points))]
    colours = (0.5 + SH_C0 * gaussians.sh[rows, 0]).nan_to_num(0.5).clamp(0, 1) * 255
    places, shades = gaussians.means[rows].tolist(), colours.round().int().tolist()
    return [
        f"{number} {_format_numbers(place)} {' '.join(map(str, shade))} 0"
        for number, (place, shade) in enumerate(zip(places, shades, strict=True), start=1)
    ]


def _format_numbers(numbers) -> str:
    return " ".join(f"{float(number):.10g}" for number in numbers)


def _shape(path: Path) -> tuple[tuple[int, int], int]:
    """Size and orientation of a photo, as stored."""
    try:
        with opened_picture(path) as picture:
            return stored_shape(picture)
    except (OSError, ValueError, SyntaxError) as error:
        raise SceneFileError(f"the photo {path} of a pose cannot be read; check the path") from error


def _same_shape(size: tuple[int, int], said: tuple[int, int]) -> bool:
    """Whether one is the other scaled, each side rounded to within a pixel."""
    return abs(size[0] * said[1] - size[1] * said[0]) <= max(sum(size), sum(said))


def _told_path(photo: Path) -> str:
    """With its folder."""
    return f"{photo.parent.name}/{photo.name}" if photo.parent.name else photo.name


def _colmap(path: Path) -> PosedPhotos:
    """Raises OSError: a file is missing. SceneFileError: too much. `_DAMAGE`: it holds something else."""
    seen = read_model(path)
    names = [_portable(each.name) for each in seen]
    places = [place / _IMAGES for place in (path.parent, *list(path.parent.parents)[:2])] + [path.parent]
    folder = next((p for p in places if any((p / name).is_file() for name in names)), places[0])
    Ks, sizes = zip(*(each.lens for each in seen), strict=True) if seen else ((), ())
    viewmats = torch.stack([each.viewmat for each in seen])
    return PosedPhotos(tuple(folder / name for name in names), viewmats, torch.stack(Ks), sizes, folder)


def _portable(name: str) -> str:
    """A path as Windows writes it, too."""
    return os.path.normpath(name.replace("\\", "/"))


def _transforms(path: Path) -> PosedPhotos:
    """Raises OSError: the file is missing. Any of `_DAMAGE`: it holds something else."""
    document = json.loads("\n".join(text_lines(path)))
    paths, viewmats, Ks, sizes = [], [], [], []
    for frame in document["frames"]:
        own = {**{name: value for name, value in document.items() if name != "frames"}, **frame}
        name = str(frame["file_path"])
        _check_lens(own, name)
        pose = torch.tensor(frame["transform_matrix"], dtype=torch.float64).reshape(-1, 4)[:3]
        pose = torch.cat((pose, torch.tensor([[0.0, 0, 0, 1]], dtype=torch.float64)))
        file = path.parent / _portable(name)
        paths.append(file if file.suffix else file.with_suffix(".png"))  # synthetic data sets leave it out
        size = (int(own["w"]), int(own["h"])) if "w" in own and "h" in own else _shape(paths[-1])[0]
        if "fl_x" not in own:
            own["fl_x"] = size[0] / 2 / math.tan(float(own["camera_angle_x"]) / 2)
        focal = float(own["fl_x"])
        usual = {"fl_y": focal, "cx": size[0] / 2, "cy": size[1] / 2}
        Ks.append(pinhole(focal, *(float(own.get(key, value)) for key, value in usual.items())))
        viewmats.append(invert_rigid(pose @ _FLIP))
        sizes.append(size)
    folder = _photo_folder(path.parent, paths)
    return PosedPhotos(tuple(paths), torch.stack(viewmats), torch.stack(Ks), tuple(sizes), folder)


def _check_lens(own: dict, name: str) -> None:
    """Raises ValueError: the lens of a frame is no pinhole."""
    flags = [flag for flag in _OTHER_LENSES if own.get(flag)]
    model = str(own.get("camera_model") or "OPENCV").upper()
    bends = [float(own.get(key) or 0) for key in _BENDS]
    listed = own.get("distortion_params") or []
    check_pinhole(flags[0] if flags else model, [*bends, *(float(n) for n in listed)], f"the lens of {name}")


def _photo_folder(folder: Path, paths: list[Path]) -> Path:
    """From which on paths tell photos apart: the folder of a transforms.json, or the one in it that all are
    in; where they lie elsewhere, the one that all share."""
    inside = [path.relative_to(folder).parts for path in paths if path.is_relative_to(folder)]
    if len(inside) < len(paths):
        return Path(os.path.commonpath([str(path.parent) for path in paths]))
    firsts = {parts[0] for parts in inside}
    return folder / firsts.pop() if len(firsts) == 1 and min(map(len, inside)) > 1 else folder


def _check(posed: PosedPhotos) -> None:
    """Raises ValueError: poses are no rotations, or lenses none."""
    rotations = posed.viewmats[:, :3, :3]
    wrong = (rotations @ rotations.transpose(1, 2) - torch.eye(3, dtype=torch.float64)).abs().amax()
    if not (bool(torch.isfinite(posed.viewmats).all()) and float(wrong) < 1e-2):
        raise ValueError("a pose is not a rotation and a translation")
    if bool((torch.linalg.det(rotations) < 0).any()):
        raise ValueError("a pose mirrors the world")
    focal = posed.Ks[:, [0, 1], [0, 1]]
    if not (bool(torch.isfinite(posed.Ks).all()) and bool((focal > 0).all())):
        raise ValueError("a focal length is not above 0")
    if any(min(size) < 1 for size in posed.sizes):
        raise ValueError("a photo has no pixels")
