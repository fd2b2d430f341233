"""The desktop's own dialog for files, where it has one."""

import shutil
import sys
from pathlib import Path

from imgui_bundle import portable_file_dialogs

from ..scene.drops import FILM_SUFFIXES, PHOTO_SUFFIXES, SCENE_SUFFIXES

_HELPERS = ("zenity", "matedialog", "qarma", "kdialog")  # what portable-file-dialogs calls on Linux


def is_there() -> bool:
    """Whether this desktop has a dialog of its own."""
    return sys.platform in ("darwin", "win32") or any(map(shutil.which, _HELPERS))


class NativeDialog:
    """One dialog; it is open until `chosen` says something. Main thread only."""

    def __init__(self, folder: str, scenes_alone: bool = False) -> None:
        suffixes = SCENE_SUFFIXES if scenes_alone else {*PHOTO_SUFFIXES, *FILM_SUFFIXES, *SCENE_SUFFIXES}
        endings = " ".join(f"*{suffix}" for suffix in sorted(suffixes))
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
