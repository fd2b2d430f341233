"""What the compressed formats share: rows in other axes, smallest-three quaternions, Morton order, limits.

A unit quaternion is stored by its three smallest entries, the largest being positive and implied;
which entry that is takes two bits. The entries lie within 1/sqrt(2).
"""

import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export.settings import PACKING
from langflash_core.export.stored import Rows
from langflash_core.geometry.turning import axes_matrix, turned_quats, turned_sh
from langflash_core.types import Gaussians

_NO_ZSTD = "zstd is not installed; pip install 'langflash[formats]'"
_OTHERS = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])  # entries but the largest, in order


def transform_rows(rows: Rows, matrix: torch.Tensor) -> Rows:
    """Rows of Gaussians moved by x' = M x, M (3, 3) orthogonal; scales and opacities stay as they are."""
    means, quats, sh = (torch.tensor(values) for values in (rows.means, rows.quats, rows.sh))
    moved = (means.double() @ matrix.double().T).float()
    quats, sh = turned_quats(quats, matrix), turned_sh(sh, matrix)
    return replace(rows, means=moved.numpy(), quats=quats.numpy(), sh=sh.numpy())


@np.errstate(over="ignore", invalid="ignore")  # rows that are not finite stay out
def place_rows(rows: Rows, place: np.ndarray, axes: str) -> Rows:
    """Rows below a node of another scene graph, in the axes of a `Scene`.

    Args:
        place: (4, 4) from the node to its world: a rotation or mirror, one scale, a translation.
        axes: of that world, three letters.

    Raises:
        ValueError: the node stretches its axes by different amounts, to nothing, or out of the world.
    """
    if not np.isfinite(place).all():
        raise ValueError("a node's place is not finite")
    linear, ours = place[:3, :3], axes_matrix(axes).T
    size = float(np.cbrt(abs(np.linalg.det(linear))))
    if not size > 0 or np.abs(linear.T @ linear / size**2 - np.eye(3)).max() > PACKING.even:
        raise ValueError("a node stretches its Gaussians unevenly")
    means, scales = ((values * size).astype(np.float32) for values in (rows.means, rows.scales))
    sized = replace(rows, means=means, scales=scales)
    moved = transform_rows(sized, ours @ torch.from_numpy(linear / size))
    return replace(moved, means=moved.means + (ours.numpy() @ place[:3, 3]).astype(np.float32))


def smallest_three(quats: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Place (n,) of the largest entry of unit quaternions (n, 4), and the other three (n, 3)."""
    largest = np.abs(quats).argmax(1)
    top = np.take_along_axis(quats, largest[:, None], 1)
    signed = np.where(top < 0, -quats, quats)
    return largest, np.take_along_axis(signed, _OTHERS[largest], 1)


def from_smallest_three(largest: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Quaternions (n, 4) float32 of what `smallest_three` gives."""
    quats = np.empty((len(others), 4), np.float32)
    np.put_along_axis(quats, _OTHERS[largest], others.astype(np.float32), 1)
    rest = np.sqrt(np.maximum(0, 1 - (others.astype(np.float64) ** 2).sum(1)))
    np.put_along_axis(quats, largest[:, None], rest[:, None].astype(np.float32), 1)
    return quats


def to_bytes(values: np.ndarray) -> np.ndarray:
    """Rounded to uint8, 0 to 255."""
    return np.clip(np.round(values), 0, 255).astype(np.uint8)


def morton_order(means: np.ndarray) -> np.ndarray:
    """Order (n,) along a Z curve of 1024 steps a side: neighbours in space become neighbours in the file."""
    low = means.min(0)
    side = np.maximum(means.max(0) - low, 1e-12)
    cells = np.clip((means - low) / side * 1024, 0, 1023).astype(np.uint32)
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        cells = (cells | (cells << shift)) & mask
    return np.argsort(cells[:, 0] | cells[:, 1] << 1 | cells[:, 2] << 2, kind="stable")


def error_line(error: BaseException) -> str:
    """What a decoder says, in one short line; some cannot say it in UTF-8."""
    try:
        return " ".join(str(error).split())[:100]
    except UnicodeDecodeError:
        return "its text is no text"


def check_some(gaussians: Gaussians, path: Path) -> None:
    """Raises OutputError: there is nothing to write."""
    if not len(gaussians):
        raise OutputError(f"cannot write {path.name}: the scene holds no Gaussians; keep some of them")


def inflate(content: bytes, size: int, name: str, *, wbits: int) -> bytes:
    """At most `size` bytes of a deflate or gzip stream; fewer where it ends, whole, earlier.

    Args:
        wbits: as zlib.decompressobj takes it.

    Raises:
        SceneFileError: it is no such stream, damaged, or cut off.
    """
    stream = zlib.decompressobj(wbits)
    try:
        plain = stream.decompress(content, size)
    except zlib.error as error:
        raise SceneFileError(f"{name} is damaged: it cannot be unpacked; export or copy it again") from error
    if len(plain) < size and not stream.eof:
        raise SceneFileError(f"{name} is cut off: its packed content does not end; export or copy it again")
    return plain


def has_zstd() -> bool:
    """Whether zstd streams can be read and written."""
    return _zstandard() is not None or _own_zstd() is not None


def zstd_packed(content: bytes) -> bytes:
    """A zstd stream.

    Raises:
        OutputError: no zstd is installed.
    """
    module = _own_zstd() or _zstandard()
    if module is None:
        raise OutputError(f"the file cannot be packed: {_NO_ZSTD}")
    return module.compress(content)


def zstd_inflated(content: bytes, size: int, name: str) -> bytes:
    """Exactly `size` bytes of a zstd stream, in no more memory than twice that.

    Raises:
        SceneFileError: it is no such stream, damaged, of another size, or no zstd is installed.
    """
    own, package = _own_zstd(), _zstandard()
    module = own or package
    if module is None:
        raise SceneFileError(f"{name} cannot be unpacked: {_NO_ZSTD}")
    try:
        if own is not None:
            plain = own.ZstdDecompressor().decompress(content, size + 1)
        else:
            unpacker = module.ZstdDecompressor(max_window_size=max(size, PACKING.window))
            plain = unpacker.stream_reader(content, read_across_frames=False).read(size + 1)
    except module.ZstdError as error:
        raise SceneFileError(f"{name} is damaged: it cannot be unpacked; export or copy it again") from error
    if len(plain) != size:
        raise SceneFileError(f"{name} is damaged: a stream of it is not of its size; export or copy it again")
    return plain


def _own_zstd():
    """Python's own, from 3.14 on."""
    try:
        from compression import zstd  # pyright: ignore[reportMissingImports]
    except ImportError:
        return None
    return zstd


def _zstandard():
    try:
        import zstandard
    except ImportError:
        return None
    return zstandard
