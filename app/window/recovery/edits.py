"""Edits that are not saved yet, kept where a crash cannot take them, and offered again.

One pair of files a scene and session in the folder of the program's state: the scene as it was
opened, and the history of its edits. Both are written whole. The eight newest are kept. `token`
names the session.
"""

from collections.abc import Collection, Iterable
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from langflash_core.errors import SceneFileError
from langflash_core.scene.edits import History

from ...places import state_folder
from ..scene.drops import SCENE_SUFFIX, still_there
from .records import forget, forget_exported, newest_first
from .state import KeptPhoto, Offer

if TYPE_CHECKING:
    from langflash_core.types import Scene


MOST_KEPT = 8
SUFFIX = ".edits"


def keep(
    scene: "Scene",
    history: History,
    name: str,
    path: Path | None,
    token: str,
    photos: Iterable[KeptPhoto] = (),
) -> Path:
    """Write edits, and their scene where it is not there yet; returns the file of edits.

    Args:
        photos: of the tray.

    Raises:
        OutputError: the folder cannot be written.
    """
    from langflash_core.base.files import make_folder
    from langflash_core.scene.edits_file import save_history, scene_digest
    from langflash_core.scene.file import save

    digest = scene_digest(scene)
    edits = _place(digest, token)
    make_folder(edits.parent)
    if not edits.with_suffix(SCENE_SUFFIX).is_file():
        save(scene, edits.with_suffix(SCENE_SUFFIX))
    where = None if path is None else str(path)
    about = {"name": name, "path": where, "photos": [list(photo) for photo in photos]}
    save_history(history, scene, about, edits)
    for old in newest_first(f"*{SUFFIX}")[MOST_KEPT:]:
        forget(old)
    return edits


def forget_edits(scene: "Scene", token: str) -> None:
    """Remove the edits that a session kept of a scene; nothing there is fine."""
    from langflash_core.scene.edits_file import scene_digest

    forget(_place(scene_digest(scene), token))


def forget_scene(scene: "Scene | None", paths: Collection[Path], copies: Iterable[Path] = ()) -> None:
    """Remove all that any session kept of a scene, found by its content or its paths; of this session its
    `copies`, and of those that ended badly what they exported."""
    from langflash_core.scene.edits_file import read_about, scene_digest

    digest, names = None if scene is None else scene_digest(scene), {str(path) for path in paths}
    for edits in newest_first(f"*{SUFFIX}"):
        with suppress(SceneFileError):
            found, about, _ = read_about(edits)
            if found == digest or about.get("path") in names:
                forget(edits)
    for file in copies:
        with suppress(OSError):
            file.unlink(missing_ok=True)
    forget_exported()


def find(scene: "Scene | None" = None, path: Path | None = None) -> Offer | None:
    """Edits kept of this scene, by its content or its path; without a scene the newest of all."""
    from langflash_core.scene.edits_file import read_about, scene_digest

    wanted = None if scene is None else scene_digest(scene)
    for edits in newest_first(f"*{SUFFIX}"):
        with suppress(SceneFileError, OSError):  # what is damaged, or went meanwhile, is passed over
            digest, about, count = read_about(edits)
            ours = path is not None and about.get("path") == str(path)
            if count and edits.with_suffix(SCENE_SUFFIX).is_file() and (wanted in (None, digest) or ours):
                when = datetime.fromtimestamp(edits.stat().st_mtime)
                photos, missing = _tray(about.get("photos"))
                return Offer(edits, str(about.get("name", "")), count, when, photos, missing)
    return None


def _tray(entries: object) -> tuple[tuple[KeptPhoto, ...], tuple[str, ...]]:
    """The photos that a file of edits names, and the names of those that have gone; none where it is
    damaged, or of an earlier version."""
    try:
        return still_there((str(path), fov) for path, fov in entries)  # pyright: ignore[reportGeneralTypeIssues]
    except (TypeError, ValueError, ArithmeticError):
        return (), ()


def _place(digest: str, token: str) -> Path:
    return state_folder() / f"{digest[:20]}-{token}{SUFFIX}"
