"""The session as it stands, on disk while the program runs, so that a crash does not take it.

One JSON file per running window and a lock beside it that the system opens when the process dies,
however it dies. A file whose lock is free belongs to nobody: it is offered again.
"""

import json
import os
from contextlib import suppress
from dataclasses import asdict, replace
from math import isfinite
from pathlib import Path

from langflash_core.geometry.poses import read_pose

from ...places import state_folder
from ..scene.drops import SCENE_SUFFIX, still_there
from .locks import is_free
from .state import Kept

PREFIX = "session-"
MOST_LEFT = 8  # as many as there may be edits of
EDITED, SELECTION = f".edited{SCENE_SUFFIX}", f".selection{SCENE_SUFFIX}"
CONTENTS = (".json", SCENE_SUFFIX, EDITED, SELECTION)
DAMAGED = (
    OSError, ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError,
)  # fmt: skip
"""What reading a file that is damaged, or another's, raises."""


def left_behind() -> Kept | None:
    """The newest session that ended badly and holds something; the one before it is offered once that is
    done with, and so on. Empty ones are removed, and those that are older than the newest `MOST_LEFT`."""
    forget_exported()
    found: list[tuple[float, Kept]] = []
    with suppress(OSError):
        for path in state_folder().glob(f"{PREFIX}*.json"):
            if not is_free(path.with_suffix(".lock")):
                continue
            try:
                kept, when = read(path), path.stat().st_mtime
            except OSError:
                continue  # another window ended it meanwhile; or it can be read tomorrow
            if kept is None or kept.empty:
                forget(path)
            else:
                found.append((when, kept))
    found.sort(key=lambda each: each[0], reverse=True)
    for _, old in found[MOST_LEFT:]:
        if old.file is not None:
            forget(old.file)
    return found[0][1] if found else None


def read(path: Path) -> Kept | None:
    """A kept session without what has gone since; None where the file is damaged.

    Raises:
        OSError: the system does not give it.
    """
    stored = path.read_bytes()
    try:
        return understood(json.loads(stored), path)
    except DAMAGED:
        return None


def understood(content: dict, file: Path | None = None) -> Kept:
    """A session of what `fields` gave, without what has gone since. file: that it was read from.

    Raises:
        One of `DAMAGED`: it is something else.
    """
    pose = content.pop("pose")
    placed = None if pose is None else read_pose(pose)
    lists = {name: tuple(content.pop(name)) for name in ("photos", "fovs", "phrases")}
    asked = _asked(content, len(lists["phrases"]))
    kept = Kept(pose=placed, file=file, **asked, **lists, **content)
    words = (kept.scene, kept.edits, kept.name, kept.mode, *kept.photos, *kept.phrases)
    if not all(isinstance(word, str) for word in words):  # a number would name an open file
        raise ValueError("expected texts")
    there, missing = still_there(zip(kept.photos, kept.fovs, strict=True))
    photos, fovs = tuple(photo for photo, _ in there), tuple(fov for _, fov in there)
    edits = kept.edits if kept.edits and os.path.isfile(kept.edits) else ""
    scene = kept.scene if edits or (kept.scene and os.path.isfile(kept.scene)) else ""
    return replace(kept, photos=photos, fovs=fovs, scene=scene, edits=edits, missing=missing)


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


def forget(path: Path) -> None:
    """Remove a kept session with its scene and its lock."""
    for suffix in (*CONTENTS, ".lock"):
        with suppress(OSError):
            path.with_suffix(suffix).unlink(missing_ok=True)


def forget_exported() -> None:
    """Remove scenes that exports of sessions which ended badly were made from; nobody goes on with those."""
    for suffix in (EDITED, SELECTION):
        with suppress(OSError):
            for file in list(state_folder().glob(f"{PREFIX}*{suffix}")):
                stem = file.name.removesuffix(suffix)
                if is_free(file.with_name(f"{stem}.lock")):
                    file.unlink(missing_ok=True)


def fields(kept: Kept) -> dict:
    """What its file holds."""
    content = asdict(replace(kept, file=None))
    del content["file"], content["missing"]
    return content
