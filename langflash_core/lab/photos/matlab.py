"""MATLAB files of published data sets: version 7.3, which is HDF5 (extra `photos`), and older ones.

MATLAB keeps columns together, so HDF5 shows every array with its axes in reverse order.
"""

from abc import abstractmethod
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

from langflash_core.base.optional import optional_packages
from langflash_core.errors import InputError

_HDF5 = b"\x89HDF\r\n\x1a\n"
_HEADER = 512
"""Bytes of MATLAB's own before the HDF5 signature."""


class MatFile:
    """Arrays of one file with MATLAB's axes; the last axis of a stack counts photos."""

    path: Path

    @abstractmethod
    def has(self, key: str) -> bool:
        """Whether there is a variable of this name."""

    @abstractmethod
    def count(self, key: str) -> int:
        """Length of the last axis."""

    @abstractmethod
    def item(self, key: str, index: int) -> np.ndarray:
        """One entry of the last axis."""

    @abstractmethod
    def array(self, key: str) -> np.ndarray:
        """A whole array."""

    @abstractmethod
    def texts(self, key: str) -> list[str]:
        """A cell array of strings, in order."""


def open_mat(path: Path) -> MatFile:
    """Open a .mat of any version.

    Raises:
        InputError: missing or damaged. MissingPackageError: of version 7.3, and h5py is not installed.
    """
    try:
        with path.open("rb") as stream:
            start = stream.read(_HEADER + len(_HDF5))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); check the path") from None
    if start[_HEADER:] == _HDF5 or start[: len(_HDF5)] == _HDF5:
        return _Hdf5(path)
    return _Older(path)


class _Older(MatFile):
    """Versions 4 to 7, read whole by scipy."""

    def __init__(self, path: Path):
        self.path = path
        try:
            self._arrays: dict[str, Any] = loadmat(str(path))
        except (MatReadError, ValueError, TypeError, OSError, NotImplementedError) as error:
            raise InputError(f"{path} is no MATLAB file ({error}); copy it again") from None

    def has(self, key: str) -> bool:
        return key in self._arrays

    def count(self, key: str) -> int:
        return self.array(key).shape[-1]

    def item(self, key: str, index: int) -> np.ndarray:
        return self.array(key)[..., index]

    def array(self, key: str) -> np.ndarray:
        if not self.has(key):
            raise InputError(f"{self.path} holds no '{key}'; it is not the file this layout needs")
        return self._arrays[key]

    def texts(self, key: str) -> list[str]:
        return [str(np.asarray(cell).ravel()[0]) if np.size(cell) else "" for cell in self.array(key).ravel()]


class _Hdf5(MatFile):
    """Version 7.3, read piece by piece."""

    def __init__(self, path: Path):
        with optional_packages():
            import h5py
        self.path = path
        try:
            self._file = h5py.File(path, "r")
        except OSError as error:
            raise InputError(f"{path} is damaged ({error}); copy it again") from None

    def has(self, key: str) -> bool:
        return key in self._file

    def count(self, key: str) -> int:
        return self._entry(key).shape[0]

    def item(self, key: str, index: int) -> np.ndarray:
        return np.asarray(self._entry(key)[index]).T

    def array(self, key: str) -> np.ndarray:
        return np.asarray(self._entry(key)).T

    def texts(self, key: str) -> list[str]:
        cells = np.asarray(self._entry(key)).ravel()
        return ["".join(chr(int(code)) for code in np.asarray(self._file[cell]).ravel()) for cell in cells]

    def _entry(self, key: str) -> Any:
        if not self.has(key):
            raise InputError(f"{self.path} holds no '{key}'; it is not the file this layout needs")
        return self._file[key]
