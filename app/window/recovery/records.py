"""What windows hold, kept where a crash cannot take it: one kind of record, in one folder.

A record (`Kept`) is one JSON file. A running window has one, `session-…`, and a lock beside it that the
system opens when the process dies, however it dies; copies of its scene lie there under the same name. As it
leaves a scene it closes the record: then that is of the scene's path, `project-…`, and says how it was left.
A session whose lock is free was closed by nobody: that is a crash, and it is offered again.
"""

import json
import os
import secrets
import shutil
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from datetime import datetime
from math import isfinite
from pathlib import Path
from typing import BinaryIO

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.errors import OutputError
from langflash_core.geometry.poses import read_pose

from ...places import PICTURE, PROJECT, earlier_projects, project_file, state_folder
from ..scene.drops import SCENE_SUFFIX, still_there
from .locks import is_free, locked
from .state import Kept

SESSION, RECORD = "session-", ".json"
EDITED, SELECTION = f".edited{SCENE_SUFFIX}", f".selection{SCENE_SUFFIX}"
MOST_LEFT = 8  # as many as there may be edits of
MOST_RECORD = 2**18  # bytes of a project's; some thousand phrases
DAMAGED = (
    OSError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError,
)  # fmt: skip
"""What reading a file that is damaged, or another's, raises."""


class Keeper:
    """Of this process. `close` takes the session's files away: nothing was lost.

    token: names the window in every file it keeps. file: its record.
    """

    def __init__(self) -> None:
        self.token = secrets.token_hex(4)
        self.file = state_folder() / f"{SESSION}{os.getpid()}-{self.token}{RECORD}"
        self._lock: BinaryIO | None = None
        self._last: Kept | None = None
        self._ended = False

    @property
    def scene_file(self) -> Path:
        """Where the copy of a scene that was never saved belongs."""
        return self.file.with_suffix(SCENE_SUFFIX)

    @property
    def edited_file(self) -> Path:
        """Where an export finds the scene with its unsaved edits."""
        return self.file.with_suffix(EDITED)

    @property
    def selection_file(self) -> Path:
        """Where an export finds what is selected."""
        return self.file.with_suffix(SELECTION)

    @property
    def copies(self) -> tuple[Path, ...]:
        """All files of this session that may hold a scene."""
        return self.scene_file, self.edited_file, self.selection_file

    def keep(self, kept: Kept) -> None:
        """Write the session where it has changed.

        Raises:
            OutputError: the folder cannot be written.
        """
        if kept == self._last or self._ended:
            return
        if self._lock is None:
            make_folder(self.file.parent)
            self._lock = locked(self.file.with_suffix(".lock"))
        write_atomically(self.file, told(kept))
        self._last = kept

    def close(self) -> None:
        """The session has ended well."""
        self._ended = True
        with suppress(OSError):  # while it is locked: else another window finds one that nobody closed
            self.file.unlink(missing_ok=True)
        if self._lock is not None:
            self._lock.close()
            self._lock = None
        forget(self.file)

    def own(self, file: Path) -> bool:
        """Whether a file of kept edits is this window's."""
        return file.stem.endswith(f"-{self.token}")


# Sessions that nobody closed


def left_behind(recent: Sequence[str] = ()) -> Kept | None:
    """The newest session that ended badly and holds something; the one before it is offered once that is
    done with, and so on. Empty ones are closed, and those that are older than the newest `MOST_LEFT`."""
    forget_exported()
    found: list[Kept] = []
    for file in newest_first(f"{SESSION}*{RECORD}"):
        if not is_free(file.with_suffix(".lock")):
            continue
        with suppress(OSError):  # another window ended it meanwhile; or it can be read tomorrow
            kept = read(file)
            if kept is None:
                forget(file)
            elif kept.empty or len(found) == MOST_LEFT:
                close(kept, recent)
            else:
                found.append(kept)
    return found[0] if found else None


def close(kept: Kept, recent: Sequence[str]) -> None:
    """Nobody goes on with a session that ended badly; its scene's project says how that was left."""
    if kept.file is None:
        return
    project = project_file(kept.scene, RECORD)
    if kept.scene in recent and modified(project) < modified(kept.file):
        with suppress(OSError):
            kept.file.replace(project)
    forget(kept.file)


def forget(file: Path) -> None:
    """Remove a session with its scenes and its lock, or kept edits with their scene; none there is fine."""
    for suffix in (file.suffix, SCENE_SUFFIX, EDITED, SELECTION, ".lock"):
        with suppress(OSError):
            file.with_suffix(suffix).unlink(missing_ok=True)


def forget_exported() -> None:
    """Remove scenes that exports of sessions which ended badly were made from; nobody goes on with those."""
    for suffix in (EDITED, SELECTION):
        for file in newest_first(f"{SESSION}*{suffix}"):
            if is_free(file.with_name(f"{file.name.removesuffix(suffix)}.lock")):
                with suppress(OSError):
                    file.unlink(missing_ok=True)


# Projects: scenes that were open lately, as they were left


def keep_project(kept: Kept) -> None:
    """Write the record of `kept.scene` as it is left; one that is too long is left out.

    Raises:
        OutputError: the folder cannot be written.
    """
    content = told(kept)
    if len(content) <= MOST_RECORD:
        make_folder(state_folder())
        write_atomically(project_file(kept.scene, RECORD), content)


def project(path: str) -> Kept:
    """How a scene was left, or stands in a window that nobody closed: its path alone where no record is
    whole."""
    files = [project_file(path, RECORD), *newest_first(f"{SESSION}*{RECORD}")]
    for file in sorted(files, key=modified, reverse=True):
        with suppress(OSError):
            kept = read(file, path) if file.stat().st_size <= MOST_RECORD else None
            if kept is not None and kept.scene == path:
                return kept.closed()
    return Kept(scene=path)


def sweep(recent: Iterable[str]) -> tuple[str, ...]:
    """Remove projects that have gone, or are not among the recent ones; returns those that are there."""
    _take_over()
    found = newest_first(f"{PROJECT}*")  # what is written while a disk is waited for is none of them
    there = tuple(path for path in recent if path and os.path.isfile(path))
    _keep_alone(there, found)
    return there


def forget_others(recent: Iterable[str], suffix: str) -> None:
    """Remove what is kept of scenes that are not among the recent ones, without a look at those. suffix: of
    records or of pictures."""
    _keep_alone(recent, newest_first(f"{PROJECT}*{suffix}"))


def _keep_alone(recent: Iterable[str], found: Iterable[Path]) -> None:
    names = {project_file(path, suffix).name for path in recent for suffix in (RECORD, PICTURE)}
    for file in found:
        if file.name not in names:
            with suppress(OSError):
                file.unlink()


def _take_over() -> None:
    """What earlier versions kept of projects, beside the preferences."""
    with suppress(OSError, OutputError):
        for file in list(earlier_projects().iterdir()):
            make_folder(state_folder())
            shutil.move(file, state_folder() / f"{PROJECT}{file.name}")
        earlier_projects().rmdir()


# Files of records


def newest_first(pattern: str) -> list[Path]:
    """Kept files; none where the folder cannot be looked into, and without those that go meanwhile."""
    found = []
    with suppress(OSError):
        for file in state_folder().glob(pattern):
            with suppress(OSError):
                found.append((file.stat().st_mtime, file))
    return [file for _, file in sorted(found, reverse=True)]


def modified(file: Path) -> float:
    """When a file was written, seconds; 0 where there is none."""
    try:
        return file.stat().st_mtime
    except (OSError, ValueError):
        return 0.0


def told(kept: Kept) -> bytes:
    """What its file holds."""
    content = asdict(replace(kept, file=None))
    for name in ("file", "missing", "when"):
        del content[name]
    return json.dumps(content).encode()


def read(file: Path, scene: str | None = None) -> Kept | None:
    """A record without what has gone since; None where the file is damaged, or of another scene than `scene`,
    whose photos are not looked for.

    Raises:
        OSError: the system does not give it.
    """
    stored, when = file.read_bytes(), datetime.fromtimestamp(file.stat().st_mtime)
    try:
        content = json.loads(stored)
        if "session" in content:  # a project of an earlier version
            content = {**content["session"], "views": content["views"]}
        if scene is not None and content["scene"] != scene:
            return None
        return replace(_understood(content), file=file, when=when)
    except DAMAGED:
        return None


def _understood(content: dict) -> Kept:
    """A record of what `told` gave, without what has gone since.

    Raises:
        One of `DAMAGED`: it is something else.
    """
    pose, aside = content.pop("pose"), content.pop("aside", None)
    lists = {name: tuple(content.pop(name)) for name in ("photos", "fovs", "phrases")}
    asked = _asked(content, len(lists["phrases"]))
    views = int(content.pop("views", 0))
    kept = Kept(pose=None if pose is None else read_pose(pose), views=views, **asked, **lists, **content)
    others = () if aside is None else tuple((path, fov) for path, fov in aside)
    words = (
        kept.scene,
        kept.edits,
        kept.name,
        kept.mode,
        *kept.photos,
        *kept.phrases,
        *(p for p, _ in others),
    )
    if views < 0 or not all(isinstance(word, str) for word in words):  # a number would name an open file
        raise ValueError("expected texts, and a count of photos")
    there, missing = still_there(zip(kept.photos, kept.fovs, strict=True))
    edits = kept.edits if kept.edits and os.path.isfile(kept.edits) else ""
    scene = kept.scene if edits or (kept.scene and os.path.isfile(kept.scene)) else ""
    kept = replace(kept, scene=scene, edits=edits, aside=None if aside is None else still_there(others)[0])
    return kept.with_photos(there, missing)


def _asked(content: dict, count: int) -> dict[str, tuple]:
    """What is kept of `count` phrases beside their words, taken out of a file's content; one of an earlier
    version has less.

    Raises:
        ValueError, TypeError: they are damaged.
    """
    lists = {name: content.pop(name, ()) for name in ("likes", "thresholds", "colours", "visible")}
    if not {len(each) for each in lists.values()} <= {0, count}:
        raise ValueError(f"expected likes, thresholds and looks of {count} phrases, or none")
    if any(len(bytes.fromhex(each)) % 4 for each in lists["likes"]):
        raise ValueError("expected whole numbers of a language vector")
    colours = tuple(tuple(min(max(float(part), 0.0), 1.0) for part in each) for each in lists["colours"])
    if any(len(each) != 3 or not all(map(isfinite, each)) for each in colours):
        raise ValueError("expected three numbers of a colour")
    return {
        "likes": tuple(lists["likes"]),
        "thresholds": tuple(None if each is None else float(each) for each in lists["thresholds"]),
        "colours": colours,
        "visible": tuple(bool(each) for each in lists["visible"]),
    }
