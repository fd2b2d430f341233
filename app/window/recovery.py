"""The session as it stands, on disk while the program runs, so that a crash does not take it.

One JSON file per running window and a lock beside it that the system opens when the process dies,
however it dies. A file whose lock is free belongs to nobody: it is offered again.
"""

import json
import os
import secrets
import sys
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import BinaryIO

from app.window.drops import SCENE_SUFFIX
from app.window.places import state_folder
from app.window.poses import Pose, Rotation, Vector
from langflash_core.errors import OutputError
from langflash_core.files import make_folder, write_atomically

_PREFIX = "session-"
_EDITED, _SELECTION = f".edited{SCENE_SUFFIX}", f".selection{SCENE_SUFFIX}"
_CONTENTS = (".json", SCENE_SUFFIX, _EDITED, _SELECTION)


@dataclass(frozen=True)
class Kept:
    """What a session holds. scene: its file, or the copy kept of one that was never saved, then
    `saved` is false. edits: the file of those that nobody saved. phrases: texts. file: where this
    was read from."""

    photos: tuple[str, ...] = ()
    fovs: tuple[float | None, ...] = ()
    scene: str = ""
    edits: str = ""
    saved: bool = True
    name: str = ""
    phrases: tuple[str, ...] = ()
    mode: str = "RGB"
    pose: Pose | None = None
    file: Path | None = None

    @property
    def empty(self) -> bool:
        """Whether nothing would be lost."""
        return not (self.photos or self.scene or any(self.phrases))

    def sentence(self) -> str:
        """What it holds, for people."""
        parts = [self.name or Path(self.scene).name] if self.scene else []
        if self.photos:
            parts.append(f"{len(self.photos)} photo{'s' * (len(self.photos) > 1)}")
        phrases = [phrase for phrase in self.phrases if phrase.strip()]
        if phrases:
            parts.append(f"{len(phrases)} phrase{'s' * (len(phrases) > 1)}")
        return ", ".join(parts)


class Keeper:
    """Keeps the session of this process. `close` takes the file away: nothing was lost."""

    def __init__(self) -> None:
        self._folder = state_folder()
        self._stem = f"{_PREFIX}{os.getpid()}-{secrets.token_hex(4)}"
        self._lock: BinaryIO | None = None
        self._last: Kept | None = None
        self._ended = False

    @property
    def scene_file(self) -> Path:
        """Where the copy of a scene that was never saved belongs."""
        return self._folder / f"{self._stem}{SCENE_SUFFIX}"

    @property
    def edited_file(self) -> Path:
        """Where an export finds the scene with its unsaved edits."""
        return self._folder / f"{self._stem}{_EDITED}"

    @property
    def selection_file(self) -> Path:
        """Where an export finds what is selected."""
        return self._folder / f"{self._stem}{_SELECTION}"

    def keep(self, kept: Kept) -> None:
        """Write the session where it has changed.

        Raises:
            OutputError: the folder cannot be written.
        """
        if kept == self._last or self._ended:
            return
        if self._lock is None:
            make_folder(self._folder)
            self._lock = _locked(self._folder / f"{self._stem}.lock")
        write_atomically(self._folder / f"{self._stem}.json", json.dumps(_fields(kept)).encode())
        self._last = kept

    def close(self) -> None:
        """The session has ended well."""
        self._ended = True
        for suffix in _CONTENTS:
            with suppress(OSError):
                (self._folder / f"{self._stem}{suffix}").unlink(missing_ok=True)
        if self._lock is not None:
            self._lock.close()
            self._lock = None
        with suppress(OSError):
            (self._folder / f"{self._stem}.lock").unlink(missing_ok=True)


def left_behind() -> Kept | None:
    """The newest session that ended badly and holds something; older and empty ones are removed."""
    found: list[tuple[float, Kept]] = []
    with suppress(OSError):
        for path in state_folder().glob(f"{_PREFIX}*.json"):
            if not _abandoned(path.with_suffix(".lock")):
                continue
            kept = read(path)
            if kept is None or kept.empty:
                forget(path)
            else:
                found.append((path.stat().st_mtime, kept))
    found.sort(key=lambda each: each[0], reverse=True)
    for _, old in found[1:]:
        if old.file is not None:
            forget(old.file)
    return found[0][1] if found else None


def read(path: Path) -> Kept | None:
    """A kept session without what has gone since; None where the file is damaged."""
    try:
        content = json.loads(path.read_bytes())
        pose = content.pop("pose")
        placed = None
        if pose is not None:
            centre, rotation = Vector(*map(float, pose["centre"])), Rotation(*map(float, pose["rotation"]))
            rest = {name: float(pose[name]) for name in ("reach", "fov", "aspect")}
            shift = (float(pose["shift"][0]), float(pose["shift"][1]))
            placed = Pose(centre, rotation, shift=shift, **rest)
        lists = {name: tuple(content.pop(name)) for name in ("photos", "fovs", "phrases")}
        kept = Kept(pose=placed, file=path, **lists, **content)
        there = [os.path.isfile(photo) for photo in kept.photos]
        photos = tuple(photo for photo, here in zip(kept.photos, there, strict=True) if here)
        fovs = tuple(fov for fov, here in zip(kept.fovs, there, strict=True) if here)
        edits = kept.edits if kept.edits and os.path.isfile(kept.edits) else ""
        scene = kept.scene if edits or (kept.scene and os.path.isfile(kept.scene)) else ""
    except (OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError):
        return None
    return replace(kept, photos=photos, fovs=fovs, scene=scene, edits=edits)


def forget(path: Path) -> None:
    """Remove a kept session with its scene and its lock."""
    for suffix in (*_CONTENTS, ".lock"):
        with suppress(OSError):
            path.with_suffix(suffix).unlink(missing_ok=True)


def _fields(kept: Kept) -> dict:
    content = asdict(replace(kept, file=None))
    del content["file"]
    return content


def _locked(path: Path) -> BinaryIO:
    """A lock file, held until it is closed or the process ends."""
    try:
        stream = path.open("wb")
        stream.write(b"\0")
        stream.flush()
        _lock(stream)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
    return stream


def _abandoned(path: Path) -> bool:
    """Whether nobody holds the lock."""
    try:
        with path.open("r+b") as stream:
            _lock(stream)
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return True


def _lock(stream: BinaryIO) -> None:
    """Without waiting.

    Raises:
        OSError: another process holds it.
    """
    if sys.platform == "win32":
        import msvcrt

        stream.seek(0)
        msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
