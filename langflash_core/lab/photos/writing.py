"""Writing a folder of labelled photos, as `folder` reads it: whole files, and what is there stays.

Tables are written last: a folder with names.csv or photos.json is complete.
"""

import csv
import io
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image
from torch import Tensor

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.errors import InputError
from langflash_core.lab.photos.names import class_of, spoken

MOST_MILLIMETRES = 65_535


class FolderWriter:
    """Writes photos one by one; `finish` writes the tables. An interrupted run continues."""

    def __init__(self, root: Path):
        self.root = root
        self.count = 0
        self._cameras: dict[str, tuple[float, float, float, float]] = {}
        self._poses: dict[str, Tensor] = {}
        make_folder(root / "images")

    def photo(self, id: str, picture: Path | np.ndarray) -> None:
        """A file, kept byte for byte, or pixels (H, W, 3) uint8, written as PNG.

        Raises:
            InputError: the file cannot be read. OutputError: the folder cannot be written.
        """
        if isinstance(picture, Path):
            path = self.root / "images" / f"{id}{picture.suffix.lower()}"
            if not path.exists():
                write_atomically(path, _bytes(picture))
        else:
            self._map("images", id, picture)
        self.count += 1

    def labels(self, id: str, ids: np.ndarray) -> None:
        """Ids (H, W), 0 = not labelled."""
        self._map("labels", id, ids.astype(np.uint16))

    def depths(self, id: str, metres: np.ndarray) -> None:
        """z (H, W) in metres, kept in millimetres; 0, negative, NaN and beyond 65 m become unknown."""
        steps = np.nan_to_num(metres.astype(np.float64) * 1000, nan=0.0, posinf=0.0, neginf=0.0).round()
        self._map(
            "depths", id, np.where((steps > 0) & (steps <= MOST_MILLIMETRES), steps, 0).astype(np.uint16)
        )

    def camera(self, id: str, fx: float, fy: float, cx: float, cy: float) -> None:
        """Pixels of the photo as stored."""
        self._cameras[id] = (fx, fy, cx, cy)

    def pose(self, id: str, camera_to_world: Tensor) -> None:
        """(4, 4), OpenCV axes."""
        self._poses[id] = camera_to_world

    def finish(self, names: Mapping[int, tuple[str, str | None]], source: str, **about: object) -> None:
        """Write names.csv (id -> name, class of forty or None to look it up), intrinsics.csv, poses.txt
        and photos.json.

        Args:
            source: of the photos, for people. about: further fields of photos.json.
        """
        if names:
            rows = [(id, name, label or class_of(name) or "") for id, (name, label) in sorted(names.items())]
            self._table("names.csv", ("id", "name", "class40"), rows)
        if self._cameras:
            self._table(
                "intrinsics.csv",
                ("id", "fx", "fy", "cx", "cy"),
                [(id, *(f"{v:.6g}" for v in camera)) for id, camera in self._cameras.items()],
            )
        if self._poses:
            lines = [
                " ".join((id, *(f"{v:.9g}" for v in pose.flatten().tolist())))
                for id, pose in self._poses.items()
            ]
            write_atomically(self.root / "poses.txt", ("\n".join(lines) + "\n").encode())
        document = {"source": source, **{k: v for k, v in about.items() if v is not None}}
        write_atomically(self.root / "photos.json", (json.dumps(document, indent=2) + "\n").encode())

    def _map(self, kind: str, id: str, values: np.ndarray) -> None:
        path = self.root / kind / f"{id}.png"
        if path.exists():
            return
        make_folder(path.parent)
        stream = io.BytesIO()
        Image.fromarray(np.ascontiguousarray(values)).save(stream, "PNG")
        write_atomically(path, stream.getvalue())

    def _table(self, name: str, header: tuple[str, ...], rows: list[tuple]) -> None:
        stream = io.StringIO(newline="")
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
        write_atomically(self.root / name, stream.getvalue().encode())


class NameTable:
    """Ids for names of data sets that number them photo by photo: 1, 2, ... in order of appearance."""

    def __init__(self) -> None:
        self.names: dict[int, tuple[str, str | None]] = {}
        self._ids: dict[str, int] = {}

    def id(self, name: str) -> int:
        """The id of a name; 0 for what is no name."""
        text = spoken(name)
        if text in ("", "unlabeled", "void", "background"):
            return 0
        if text not in self._ids:
            self._ids[text] = len(self._ids) + 1
            self.names[self._ids[text]] = (text, None)
        return self._ids[text]


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); the data set needs it") from None
