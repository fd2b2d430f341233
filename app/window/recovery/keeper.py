"""Keeps what a crash must not take, for one window: its session, its scene, its unsaved edits, all
under one name. What is kept is offered again by `sessions` and `edits`."""

import json
import os
import secrets
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.scene.edits import History

from ...places import state_folder
from ..scene.drops import SCENE_SUFFIX
from ..scene.state import SceneInfo
from . import edits
from .locks import locked
from .sessions import CONTENTS, EDITED, PREFIX, SELECTION, fields
from .state import Kept, KeptPhoto


class Keeper:
    """Of this process. `close` takes the session's files away: nothing was lost.

    token: names the window in every file it keeps.
    """

    def __init__(self) -> None:
        self._folder = state_folder()
        self.token = secrets.token_hex(4)
        self._stem = f"{PREFIX}{os.getpid()}-{self.token}"
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
        return self._folder / f"{self._stem}{EDITED}"

    @property
    def selection_file(self) -> Path:
        """Where an export finds what is selected."""
        return self._folder / f"{self._stem}{SELECTION}"

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
            make_folder(self._folder)
            self._lock = locked(self._folder / f"{self._stem}.lock")
        write_atomically(self._folder / f"{self._stem}.json", json.dumps(fields(kept)).encode())
        self._last = kept

    def close(self) -> None:
        """The session has ended well."""
        self._ended = True
        for suffix in CONTENTS:
            with suppress(OSError):
                (self._folder / f"{self._stem}{suffix}").unlink(missing_ok=True)
        if self._lock is not None:
            self._lock.close()
            self._lock = None
        with suppress(OSError):
            (self._folder / f"{self._stem}.lock").unlink(missing_ok=True)

    def own(self, file: Path) -> bool:
        """Whether a file of kept edits is this window's."""
        return file.name.endswith(f"-{self.token}{edits.SUFFIX}")

    def keep_edits(self, info: SceneInfo, history: History, photos: Iterable[KeptPhoto]) -> None:
        """Write the edits of a scene, in this thread.

        Raises:
            OutputError: the folder cannot be written.
        """
        edits.keep(info.scene, history, info.name, info.path, self.token, photos)

    def forget_edits(self, info: SceneInfo) -> None:
        """Remove the edits kept of a scene; nothing there is fine."""
        edits.forget(info.scene, self.token)
