"""The desktop's own dialog for files, where it has one."""

import shutil
import sys
from collections.abc import Iterable
from pathlib import Path

from imgui_bundle import portable_file_dialogs

from langflash_core.base.formats import FILMS_IN, PHOTOS_IN
from langflash_core.base.outputs import SCENES_IN

_HELPERS = ("zenity", "matedialog", "qarma", "kdialog")  # what portable-file-dialogs calls on Linux


def is_there() -> bool:
    """Whether this desktop has a dialog of its own."""
    return sys.platform in ("darwin", "win32") or any(map(shutil.which, _HELPERS))


def patterns(endings: Iterable[str]) -> str:
    """Of names with these endings, or these whole names; in capitals, too, as cameras write them: GTK tells
    them apart."""
    stars = [f"*{ending}" if ending.startswith(".") else ending for ending in sorted(set(endings))]
    return " ".join((*stars, *(star.upper() for star in stars)))


class NativeDialog:
    """One dialog; it is open until `chosen` says something. Main thread only."""

    def __init__(self, folder: str, scenes_alone: bool = False) -> None:
        endings = patterns(SCENES_IN if scenes_alone else (*PHOTOS_IN, *FILMS_IN, *SCENES_IN))
        start = folder if Path(folder).is_dir() else str(Path.home())
        filters = ["Scenes" if scenes_alone else "Photos, films and scenes", endings, "All files", "*"]
        title = "Merge a scene into this one" if scenes_alone else "Open photos, a film or a scene"
        options = portable_file_dialogs.opt
        several = options.none if scenes_alone else options.multiselect
        self._dialog = portable_file_dialogs.open_file(title, start, filters, several)

    def chosen(self) -> tuple[str, ...] | None:
        """The files; none where it was closed, None while it is open."""
        return tuple(self._dialog.result()) if self._dialog.ready(0) else None


class NativePlace:
    """A folder to write to, in the same way."""

    def __init__(self, folder: str) -> None:
        self._dialog = portable_file_dialogs.select_folder("Write it to", folder)

    def chosen(self) -> tuple[str, ...] | None:
        """The folder; none where it was closed, None while it is open."""
        if not self._dialog.ready(0):
            return None
        folder = self._dialog.result()
        return (folder,) if folder else ()
