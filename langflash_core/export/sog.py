"""PlayCanvas's SOG, version 2: Gaussians as lossless WebP pictures and a meta.json, in a zip or a folder.

Pixel i of each picture is Gaussian i. Positions are sign(x) log(1 + |x|) as 16 bits between bounds, the
low and high bytes in two pictures; rotations the smallest three of wxyz in 8 bits each and the place of
the largest as alpha 252 to 255; log scales and f_dc indices into books of 256 numbers; opacity 8 bits.
Harmonics are a palette: a 16-bit label a Gaussian, 64 entries a row of the palette's picture, one pixel
a basis, each of its colours an index into a book of 256.

Written along a Z curve; the palette has at most 8,192 entries, k-means found where there are more.
Source: the format's description at developer.playcanvas.com, and splat-transform (MIT, PlayCanvas).
"""

import io
import json
import math
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import IO

import numpy as np
import torch
from PIL import Image

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.formats import SOG_FOLDER
from langflash_core.base.limits import FILES, GAUSSIANS
from langflash_core.base.picture_files import encoded, opened_picture
from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export.packing import check_some, error_line, from_smallest_three, morton_order
from langflash_core.export.quantised import Palette, quantise
from langflash_core.export.settings import QUANTISING, SOG_LIMITS, STORED
from langflash_core.export.stored import ANTIALIASED, PLAIN, Gathering, Rows, to_scene
from langflash_core.types import Scene

_DAMAGE = (
    OSError, ValueError, SyntaxError, LookupError, TypeError, AttributeError, ArithmeticError, RuntimeError,
    EOFError, zipfile.BadZipFile, zlib.error, struct.error,
)  # fmt: skip
_REMEDY = "export it again, or name a .ply"
_ROW = 64  # entries a row of the palette's picture
_LARGEST_SIDE = 16383  # pixels of a WebP
_TAGS = 252  # alpha of a rotation whose largest entry is the first
_MOST_PALETTE = 1 << 16  # entries that a label can name
_Opener = Callable[[str], IO[bytes]]


def read_sog(path: Path) -> Scene:
    """A scene without language from a .sog, or from the meta.json of one in a folder.

    Raises:
        SceneFileError: missing, of another version, damaged, or without a usable Gaussian.
    """
    if not path.stat().st_size:
        raise SceneFileError(f"{path.name} is an empty file; {_REMEDY}")
    try:
        if path.name.lower() == SOG_FOLDER:
            return _read_folder(path.name, lambda name: (path.parent / name).open("rb"))
        with zipfile.ZipFile(path) as archive:
            FILES.check(len(archive.infolist()), path.name, SceneFileError)
            return _read_folder(path.name, archive.open)
    except Image.DecompressionBombError as error:
        raise SceneFileError(f"{path.name} has a picture of too many pixels; {_REMEDY}") from error
    except _DAMAGE as error:
        raise SceneFileError(f"{path.name} is damaged or no SOG ({error_line(error)}); {_REMEDY}") from error


def write_sog(scene: Scene, path: Path) -> None:
    """The Gaussians of a scene as one .sog, or, where `path` is a meta.json, as files beside it.

    Raises:
        OutputError: there is nothing to write, too much for one picture, or an unwritable path.
    """
    check_some(scene.gaussians, path)
    if len(scene.gaussians) > _LARGEST_SIDE**2 // 2:
        raise OutputError(f"cannot write {path.name}: too many Gaussians for a SOG; name a .ply")
    files = _encode(scene)
    if path.name.lower() == SOG_FOLDER:
        make_folder(path.parent)
        meta = files.pop(SOG_FOLDER)  # last, so that it never names what is not there
        for name, content in files.items():
            write_atomically(path.with_name(name), content)
        return write_atomically(path, meta)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_STORED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), content)
    write_atomically(path, packed.getvalue())


def sog_files(path: Path) -> list[Path]:
    """The meta.json that `write_sog` wrote, and the pictures beside it that it names."""
    parts = [part for part in json.loads(path.read_bytes()).values() if isinstance(part, dict)]
    return [path, *(path.with_name(name) for part in parts for name in part.get("files", ()))]


def _read_folder(name: str, open_file: _Opener) -> Scene:
    """Raises SceneFileError: another version. Any of `_DAMAGE`: something does not fit."""

    def content(file: str, most: int) -> bytes:
        with open_file(file) as stream:
            found = stream.read(most + 1)
        if len(found) > most:
            raise ValueError(f"{file} is larger than its Gaussians need")
        return found

    meta = json.loads(content(SOG_FOLDER, SOG_LIMITS.most_meta))
    if meta.get("version") != 2:
        raise SceneFileError(
            f"{name} is a SOG of version {meta.get('version', 1)!r}, this program reads version 2; {_REMEDY}"
        )
    count = meta["count"]
    if not isinstance(count, int) or not 0 < count <= _LARGEST_SIDE**2:
        raise ValueError(f"its count is {count!r}")
    GAUSSIANS.check(count, name, SceneFileError)

    def pixels(part: str, index: int, needed: int = count) -> np.ndarray:
        file = meta[part]["files"][index]
        if not isinstance(file, str) or Path(file).name != file:
            raise ValueError(f"it names a file {file!r}")
        return _pixels(content(file, 8 * needed + SOG_LIMITS.slack), needed, file)

    books = {part: _book(meta[part]) for part in ("scales", "sh0")}
    lowest, highest = (np.array(meta["means"][end], np.float64).reshape(3) for end in ("mins", "maxs"))
    low, high = pixels("means", 0), pixels("means", 1)
    quats, scales, colours = pixels("quats", 0), pixels("scales", 0), pixels("sh0", 0)
    harmonics = _harmonics(meta["shN"], pixels, count) if meta.get("shN", {}).get("bands") else None
    num_bases = 1 if harmonics is None else 1 + harmonics[0].shape[1]
    gathering = Gathering(count, num_bases, name)
    for first in range(0, count, STORED.rows_at_once):
        some = slice(first, min(first + STORED.rows_at_once, count))
        whole = low[some, :3].astype(np.float64) + 256.0 * high[some, :3]
        logs = lowest + whole / 65535 * (highest - lowest)
        with np.errstate(over="ignore", invalid="ignore"):  # rows that are not finite stay out
            means = (np.sign(logs) * np.expm1(np.abs(logs))).astype(np.float32)
        sh = np.empty((len(means), num_bases, 3), np.float32)
        sh[:, 0] = books["sh0"][colours[some, :3]]
        if harmonics is not None:
            sh[:, 1:] = harmonics[0][harmonics[1][some]]
        opacities = colours[some, 3] / np.float32(255)
        gathering.add(Rows(means, _quats(quats[some]), books["scales"][scales[some, :3]], opacities, sh))
    model = str(meta.get("model") or PLAIN)
    return to_scene(gathering, name, [], logs=True, logits=False, model=model)


def _pixels(content: bytes, needed: int, name: str) -> np.ndarray:
    """The first `needed` pixels (needed, 4) uint8 of a WebP."""
    with opened_picture(content, ("WEBP",)) as picture:
        area = picture.width * picture.height
        if not needed <= area <= 2 * needed + SOG_LIMITS.slack:
            raise ValueError(f"{name} has {area:,} pixels, expected about {needed:,}")
        return np.asarray(picture.convert("RGBA")).reshape(-1, 4)[:needed]


def _book(part: dict) -> np.ndarray:
    """256 numbers (256,) float32; those that are missing are 0, as readers of the format take them."""
    numbers = np.array([0.0 if number is None else number for number in part["codebook"]], np.float64)
    book = np.zeros(QUANTISING.book, np.float32)
    book[: len(numbers)] = numbers.reshape(-1)[: QUANTISING.book]
    return book


def _harmonics(part: dict, pixels: Callable[..., np.ndarray], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (k, S - 1, 3) of the palette, and the entry (n,) of each Gaussian."""
    bands, entries = part["bands"], part["count"]
    if bands not in (1, 2, 3) or not isinstance(entries, int) or not 0 < entries <= _MOST_PALETTE:
        raise ValueError(f"its palette has {entries!r} entries of degree {bands!r}")
    bases, rows = (bands + 1) ** 2 - 1, -(-entries // _ROW)
    stored = pixels("shN", 0, rows * _ROW * bases)[:, :3]
    coefficients = _book(part)[stored].reshape(rows * _ROW, bases, 3)[:entries]
    labels = pixels("shN", 1)[:, :2].astype(np.int64)
    places = labels[:, 0] | labels[:, 1] << 8
    # Labels beyond the palette mean no gloss, as readers of the format take them.
    return np.concatenate((coefficients, np.zeros((1, bases, 3), np.float32))), np.minimum(places, entries)


def _quats(stored: np.ndarray) -> np.ndarray:
    """wxyz (n, 4) of pixels (n, 4); a tag that is none means no rotation."""
    tags = stored[:, 3].astype(np.int64) - _TAGS
    others = (stored[:, :3] / 255.0 * 2 - 1) * math.sqrt(0.5)
    quats = from_smallest_three(np.clip(tags, 0, 3), others)
    quats[tags < 0] = (1, 0, 0, 0)
    return quats


def _encode(scene: Scene) -> dict[str, bytes]:
    """Files by name."""
    order = morton_order(scene.gaussians.means.detach().cpu().double().numpy())
    stored = quantise(scene.gaussians.rows(torch.from_numpy(order)))
    files = {
        "means_l.webp": _picture(stored.steps & 255),
        "means_u.webp": _picture(stored.steps >> 8),
        "quats.webp": _picture(np.concatenate((stored.turns, _TAGS + stored.largest[:, None]), 1)),
        "scales.webp": _picture(stored.scales),
        "sh0.webp": _picture(np.concatenate((stored.colours, stored.opacities[:, None]), 1)),
    }
    meta = {
        "version": 2,
        "asset": {"generator": "LangFlash"},
        "count": len(stored.steps),
        "means": {
            "mins": stored.lowest.tolist(), "maxs": stored.highest.tolist(),
            "files": ["means_l.webp", "means_u.webp"],
        },
        "scales": {"codebook": stored.scale_book.tolist(), "files": ["scales.webp"]},
        "quats": {"files": ["quats.webp"]},
        "sh0": {"codebook": stored.colour_book.tolist(), "files": ["sh0.webp"]},
    }  # fmt: skip
    if scene.record.antialiased:
        meta["model"] = ANTIALIASED
    if stored.harmonics is not None:
        meta["shN"], more = _encoded_harmonics(stored.harmonics)
        files |= more
    return {SOG_FOLDER: json.dumps(meta).encode(), **files}


def _encoded_harmonics(harmonics: Palette) -> tuple[dict, dict[str, bytes]]:
    """The entry of meta.json and the two pictures of a palette."""
    count, bases, _ = harmonics.places.shape
    rows, labels = -(-count // _ROW), harmonics.labels
    stored = np.zeros((rows * _ROW, bases, 3), np.int64)
    stored[:count] = harmonics.places
    files = {
        "shN_centroids.webp": _picture(stored.reshape(-1, 3), _ROW * bases),
        "shN_labels.webp": _picture(np.stack((labels & 255, labels >> 8, np.zeros_like(labels)), 1)),
    }
    own = {"count": count, "bands": math.isqrt(bases + 1) - 1}
    return {**own, "codebook": harmonics.book.tolist(), "files": list(files)}, files


def _picture(values: np.ndarray, width: int | None = None) -> bytes:
    """A lossless WebP of pixels (n, 3 or 4), opaque where there is no fourth value; sides divide by 4."""
    count = len(values)
    height = count // width if width else 0
    if width is None:
        width = math.ceil(math.sqrt(count) / 4) * 4
        height = math.ceil(count / width / 4) * 4
    pixels = np.zeros((height * width, 4), np.uint8)
    pixels[:, 3] = 255
    pixels[:count, : values.shape[1]] = values
    # `exact` keeps colours where alpha is 0.
    options = {"lossless": True, "exact": True, "method": 4, "quality": 80}
    return encoded(pixels.reshape(height, width, 4), "WEBP", **options)
