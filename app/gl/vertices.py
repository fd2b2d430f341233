"""What project.vert reads of each Gaussian: place and opacity, rotation, scales, harmonics, tint."""

import math

import moderngl
import numpy as np
from torch import Tensor

from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE
from langflash_core.geometry.quaternions import unit_quats
from langflash_core.types import Gaussians

from .buffers import buffer_of

_ROWS_AT_ONCE = 1 << 16  # Gaussians: 12 MB of coefficients of degree 3


class Vertices:
    """Owns a buffer of each, of N Gaussians."""

    def __init__(self, ctx: moderngl.Context, gaussians: Gaussians, sh: Tensor, rows: np.ndarray):
        """
        Args:
            gaussians: N, without harmonics. sh: (all, S, 3), of which `rows` (N,) are theirs: most of a
                large scene's bytes, never copied as a whole.
        """
        self.degree = min(math.isqrt(sh.shape[1]) - 1, MAX_SHOWN_DEGREE)
        self._num_numbers = 3 * (self.degree + 1) ** 2  # coefficients of that degree
        self.sh_vec4s = -(-self._num_numbers // 4)
        self._stride = 16 * self.sh_vec4s  # bytes: they are flat, padded to whole vec4s
        self._shapes = [buffer_of(ctx, values) for values in _shapes(gaussians)]
        self._harmonics = ctx.buffer(reserve=max(4, self._stride * len(rows)))
        self._write_harmonics(sh.numpy(), rows)
        self._tints = buffer_of(ctx, np.zeros(-4 * (-len(rows) // 4), np.uint8))  # whole words

    def _write_harmonics(self, sh: np.ndarray, rows: np.ndarray) -> None:
        for first in range(0, len(rows), _ROWS_AT_ONCE):
            some = sh[rows[first : first + _ROWS_AT_ONCE]]
            padded = np.zeros((len(some), 4 * self.sh_vec4s), np.float32)
            padded[:, : self._num_numbers] = some.reshape(len(some), -1)[:, : self._num_numbers]
            self._harmonics.write(padded.tobytes(), offset=self._stride * first)

    def place(self, gaussians: Gaussians, sh: Tensor, rows: np.ndarray) -> None:
        """The same Gaussians elsewhere or in other colours; arguments as when made."""
        for buffer, values in zip(self._shapes, _shapes(gaussians), strict=True):
            buffer.write(np.ascontiguousarray(values).tobytes())
        self._write_harmonics(sh.numpy(), rows)

    def tint(self, tints: np.ndarray) -> None:
        """(N,) uint8, 0 for the own colour."""
        self._tints.write(np.ascontiguousarray(tints, np.uint8).tobytes())

    @property
    def content(self) -> list[tuple[moderngl.Buffer, str, str]]:
        """For a vertex array of project.vert."""
        formats = ("4f", "4f", "3f", f"{4 * self.sh_vec4s}f", "1f1")
        names = ("in_mean", "in_quat", "in_scale", "in_sh", "in_tint")
        return list(zip((*self._shapes, self._harmonics, self._tints), formats, names, strict=True))

    @property
    def buffers(self) -> tuple[moderngl.Buffer, ...]:
        """For project.comp: means, quaternions, scales, harmonics, tints."""
        return (*self._shapes, self._harmonics, self._tints)

    @property
    def most_bytes(self) -> int:
        """That any of them has of a Gaussian."""
        return max(16, self._stride)

    def release(self) -> None:
        for buffer in (self._tints, self._harmonics, *self._shapes):
            buffer.release()


def _shapes(gaussians: Gaussians) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    place = np.concatenate((gaussians.means.numpy(), gaussians.opacities.numpy()[:, None]), 1)
    return place, unit_quats(gaussians.quats).numpy(), gaussians.scales.numpy()
