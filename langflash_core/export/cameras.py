"""Cameras and photos as COLMAP's text model and as transforms.json, out and in.

COLMAP: cameras.txt (intrinsics), images.txt (quaternion wxyz and translation, world to camera, OpenCV axes,
one line each and one, here empty, of points), points3D.txt. transforms.json (instant-ngp, nerfstudio): camera
to world, OpenGL axes (right, up, back), one frame a photo, intrinsics of all or of each. The photos lie in
images/ beside the text. The centre of the top-left pixel is (0.5, 0.5) in both.

Source: COLMAP's documentation (output format); nerfstudio's (data conventions).
"""

import json
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from langflash_core.errors import OutputError, SceneFileError
from langflash_core.files import make_folder, write_atomically
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.quaternions import matrices_to_quats, quats_to_matrices
from langflash_core.limits import TEXT, VIEWS
from langflash_core.picture_files import STORED, opened_picture
from langflash_core.types import Scene

COLMAP, TRANSFORMS = "cameras.txt", "transforms.json"
_IMAGES = "images"
_FLIP = torch.diag(torch.tensor([1.0, -1.0, -1.0, 1.0], dtype=torch.float64))  # OpenGL axes and OpenCV's
# How many numbers each COLMAP model has, and where fx, fy, cx, cy are; the rest bend straight lines.
_MODELS = {
    "SIMPLE_PINHOLE": (3, (0, 0, 1, 2)),
    "PINHOLE": (4, (0, 1, 2, 3)),
    "SIMPLE_RADIAL": (4, (0, 0, 1, 2)),
    "RADIAL": (5, (0, 0, 1, 2)),
    "OPENCV": (8, (0, 1, 2, 3)),
    "FULL_OPENCV": (12, (0, 1, 2, 3)),
}
_PLACES = ((0, 0), (1, 1), (0, 2), (1, 2))  # of fx, fy, cx, cy in K
_STRAIGHT = 1e-3  # distortion below which photos count as straight
_DAMAGE = (ValueError, LookupError, TypeError, AttributeError, RecursionError, OverflowError, RuntimeError,
           struct.error)  # fmt: skip
_REMEDY = "export it again as COLMAP text or transforms.json, of undistorted photos"


@dataclass(frozen=True)
class PosedPhotos:
    """V photos with their lenses and places.

    paths: files, which may be missing. viewmats (V, 4, 4) float64, world to camera, OpenCV axes, in the
    world's own unit. Ks (V, 3, 3) float64 in pixels of photos of sizes (V) (width, height).
    """

    paths: tuple[Path, ...]
    viewmats: Tensor
    Ks: Tensor
    sizes: tuple[tuple[int, int], ...]

    def of(self, photos: Sequence[Path]) -> "PosedPhotos":
        """Only these photos, in their order, found by name; all, where none is named.

        Raises:
            SceneFileError: a photo has no pose, or a pose no photo.
        """
        by_name = {path.name: index for index, path in enumerate(self.paths)}
        missing = [photo.name for photo in photos if photo.name not in by_name]
        if missing:
            raise SceneFileError(f"there is no pose of {missing[0]}; name photos that the poses are of")
        rows = [by_name[photo.name] for photo in photos] or list(range(len(self.paths)))
        paths = tuple(photos) or self.paths
        sizes = tuple(self.sizes[row] for row in rows)
        return PosedPhotos(paths, self.viewmats[rows], self.Ks[rows], sizes)

    def lens(self) -> dict:
        """`fov` or `intrinsics` as `load_views` takes them: one lens for all, or a field of view each.

        For the photos as they lie there, which may be smaller than those the poses were found from.

        Raises:
            SceneFileError: a photo is missing or no picture.
        """
        lenses = []
        for path, K, said in zip(self.paths, self.Ks, self.sizes, strict=True):
            try:
                with opened_picture(path) as picture:
                    size = picture.size
            except (OSError, ValueError, SyntaxError) as error:
                raise SceneFileError(f"the photo {path} of a pose cannot be read; check the path") from error
            numbers = [float(K[row, column]) for row, column in _PLACES]
            ratios = (size[0] / said[0], size[1] / said[1])
            lenses.append((tuple(n * ratios[index % 2] for index, n in enumerate(numbers)), size))
        if len(set(lenses)) == 1:
            return {"intrinsics": lenses[0][0]}
        return {"fov": [2 * math.degrees(math.atan(max(size) / 2 / lens[0])) for lens, size in lenses]}


def write_colmap(scene: Scene, path: Path) -> None:
    """cameras.txt, images.txt and points3D.txt in the folder of `path`, photos in its images/.

    Raises:
        OutputError: the scene has no photos, or the folder cannot be written.
    """
    names, sizes = _write_photos(scene, path)
    lenses, places = (
        ["# CAMERA_ID, MODEL, WIDTH, HEIGHT, fx, fy, cx, cy"],
        ["# IMAGE_ID, qvec, tvec, CAMERA_ID, NAME"],
    )
    for view, (name, (width, height)) in enumerate(zip(names, sizes, strict=True)):
        K = scene.camera(view, width, height).K.double()
        numbers = (K[0, 0], K[1, 1], K[0, 2], K[1, 2])
        lenses.append(f"{view + 1} PINHOLE {width} {height} {_told(numbers)}")
        viewmat = scene.viewmats[view].double().cpu()
        quat = matrices_to_quats(viewmat[:3, :3])
        places += [f"{view + 1} {_told(quat)} {_told(viewmat[:3, 3])} {view + 1} {name}", ""]
    for name, lines in (
        ("points3D.txt", ["# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[]"]),
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
    document = {"camera_model": "PINHOLE", "frames": frames}
    write_atomically(path, json.dumps(document, indent=1).encode())


def read_posed(path: Path) -> PosedPhotos:
    """Photos and poses of a transforms.json, or of COLMAP's text model in a folder or by its cameras.txt.

    Raises:
        SceneFileError: missing, damaged, or of lenses that bend straight lines.
    """
    try:
        if path.is_dir():
            known = [
                path / TRANSFORMS,
                path / COLMAP,
                path / "sparse" / "0" / COLMAP,
                path / "sparse" / COLMAP,
            ]
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
        said = " ".join(str(error).split())[:100]
        raise SceneFileError(f"{path.name} does not hold posed photos ({said}); {_REMEDY}") from error


def _write_photos(scene: Scene, path: Path) -> tuple[list[str], list[tuple[int, int]]]:
    """Names and sizes of the photos, which lie in images/ afterwards."""
    if not scene.photos:
        raise OutputError(f"cannot write {path.name}: the scene has no photos; reconstruct it from photos")
    make_folder(path.parent / _IMAGES)
    names, sizes = [], []
    for view, photo in enumerate(scene.photos):
        names.append(f"{view:03d}.jpg")
        sizes.append(_picture_size(photo, path))
        write_atomically(path.parent / _IMAGES / names[-1], photo)
    return names, sizes


def _picture_size(photo: bytes, path: Path) -> tuple[int, int]:
    try:
        with opened_picture(photo, STORED) as picture:
            return picture.size
    except (OSError, SyntaxError, ValueError) as error:
        said = " ".join(str(error).split())[:100]
        raise OutputError(
            f"cannot write {path.name}: a photo in the scene is damaged ({said}); reconstruct it from photos"
        ) from error


def _told(numbers) -> str:
    return " ".join(f"{float(number):.10g}" for number in numbers)


def _lines(path: Path) -> list[str]:
    TEXT.check(path.stat().st_size, path.name, SceneFileError)
    return [line for line in path.read_text("utf-8").splitlines() if not line.startswith("#")]


def _colmap(path: Path) -> PosedPhotos:
    """Raises:
    OSError: a file is missing. Any of `_DAMAGE`: it holds something else.
    """
    lenses = dict(_lens(line.split()) for line in _lines(path.with_name(COLMAP)) if line.strip())
    lines = _lines(path.with_name("images.txt"))
    while lines and not lines[0].strip():
        lines.pop(0)
    paths, viewmats, Ks, sizes = [], [], [], []
    for line in lines[::2]:  # every second is a list of points
        if not line.strip():
            continue
        words = line.split(maxsplit=9)
        numbers = torch.tensor([float(word) for word in words[1:8]], dtype=torch.float64)
        viewmat = torch.eye(4, dtype=torch.float64)
        viewmat[:3, :3], viewmat[:3, 3] = quats_to_matrices(numbers[:4]), numbers[4:]
        K, size = lenses[words[8]]
        paths.append(_photo(path.parent, words[9].strip()))
        viewmats.append(viewmat)
        Ks.append(K)
        sizes.append(size)
    return PosedPhotos(tuple(paths), torch.stack(viewmats), torch.stack(Ks), tuple(sizes))


def _lens(words: list[str]) -> tuple[str, tuple[Tensor, tuple[int, int]]]:
    """Number, K and size of one line of cameras.txt."""
    count, places = _MODELS.get(words[1], (0, ()))
    numbers = [float(word) for word in words[4:]]
    if len(numbers) != count or any(abs(n) > _STRAIGHT for n in numbers[max(places, default=0) + 1 :]):
        raise ValueError(f"camera {words[0]} of model {words[1]} bends straight lines or is unknown")
    return words[0], (_K(*(numbers[place] for place in places)), (int(words[2]), int(words[3])))


def _photo(folder: Path, name: str) -> Path:
    """Where a photo of a COLMAP model lies: images/ beside the text, or above sparse/0."""
    above = [folder, *list(folder.parents)[:2]]
    found = [place / _IMAGES / name for place in above] + [folder / name]
    return next((file for file in found if file.is_file()), found[0])


def _transforms(path: Path) -> PosedPhotos:
    """Raises:
    OSError: the file is missing. Any of `_DAMAGE`: it holds something else.
    """
    document = json.loads("\n".join(_lines(path)))
    paths, viewmats, Ks, sizes = [], [], [], []
    for frame in document["frames"]:
        own = {**{name: value for name, value in document.items() if name != "frames"}, **frame}
        if any(abs(float(own.get(name, 0))) > _STRAIGHT for name in ("k1", "k2", "k3", "k4", "p1", "p2")):
            raise ValueError("its lens bends straight lines")
        pose = torch.tensor(frame["transform_matrix"], dtype=torch.float64).reshape(-1, 4)[:3]
        pose = torch.cat((pose, torch.tensor([[0.0, 0, 0, 1]], dtype=torch.float64)))
        paths.append(_frame_file(path.parent, str(frame["file_path"])))
        size = _size(own, paths[-1])
        focal = (
            float(own["fl_x"]) if "fl_x" in own else size[0] / 2 / math.tan(float(own["camera_angle_x"]) / 2)
        )
        Ks.append(
            _K(
                focal,
                float(own.get("fl_y", focal)),
                float(own.get("cx", size[0] / 2)),
                float(own.get("cy", size[1] / 2)),
            )
        )
        viewmats.append(invert_rigid(pose @ _FLIP))
        sizes.append(size)
    return PosedPhotos(tuple(paths), torch.stack(viewmats), torch.stack(Ks), tuple(sizes))


def _frame_file(folder: Path, name: str) -> Path:
    """The file of a frame; synthetic data sets leave the suffix away."""
    file = folder / name
    return file if file.suffix else file.with_suffix(".png")


def _size(own: dict, file: Path) -> tuple[int, int]:
    if "w" in own and "h" in own:
        return int(own["w"]), int(own["h"])
    with opened_picture(file) as picture:
        return picture.size


def _K(fx: float, fy: float, cx: float, cy: float) -> Tensor:
    return torch.tensor([[fx, 0, cx], [0, fy, cy], [0, 0, 1]], dtype=torch.float64)


def _check(posed: PosedPhotos) -> None:
    """Raises:
    ValueError: poses are no rotations, or lenses none.
    """
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
