"""Small pictures of scenes that were open lately: made as one is left, gone with what they show.

A picture names the file that it is of, by a stamp of size and time, and counts for no other: what somebody
hid in that file meanwhile is not shown by it. None is kept of what is not, or not yet, in the scene's file:
of a scene that nobody saved, or in which something was hidden for good. While tiles are on show their files
are looked at again: another process may hide something in one of them. A thread of its own does so: they may
lie on a disk that sleeps.
"""

import io
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path

import moderngl
import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageOps

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.picture_files import opened_picture

from ...places import PICTURE, project_file
from ..commands import Command, ShowPicture
from ..editing.mending import HiddenForGood
from ..effects import Effects, Hands
from ..kit.textures import Thumbnails
from ..scene.commands import JobCancelled, JobFailed, OpenScene, SceneArrived, SceneSaved
from ..state import State
from ..viewport import Viewport
from . import records
from .commands import ForgetRecent, PictureGone
from .effects import NEVER, NOT_REMEMBERED, Writer
from .state import Kept

REMEMBER_AFTER = 1.0  # seconds without a change, so that a burst is once
SETTLING = 0.5  # seconds until a picture that is still being drawn is asked for again
LOOK_AGAIN = 1.0  # seconds between two looks at the files of tiles
SIDES = (270, 180)
"""Of a small picture, pixels: the tile of the empty window, also where the interface is large."""
MOST_BYTES = 10 * 1024  # of a small picture
_QUALITIES = (80, 65, 50, 35, 20, 10)  # of JPEG, until it is small enough


class TileEffects(Effects):
    """The one writer of small pictures. viewport: what is seen; thumbnails: of the projects on show."""

    def __init__(self, hands: Hands, viewport: Viewport, thumbnails: Thumbnails) -> None:
        self._hands = hands
        self._viewport = viewport
        self._thumbnails = thumbnails
        self._write = Writer(hands)
        self._reading: Path | None = None  # the file whose scene is to come
        self._stamps: dict[int, str] = {}  # of scenes by their number: the file that they are in
        self._last: tuple | None = None  # what was pictured last
        self._at = NEVER
        self._looking: Future | None = None  # at the files of the tiles on show
        self._look_at = NEVER
        self._tiles: dict[str, tuple[str, str]] = {}  # stamps of what they show; the writer's thread alone

    @property
    def due(self) -> float:
        """When what has changed has rested long enough, or tiles are looked at again."""
        return min(self._at, self._look_at)

    def tick(self, state: State, now: float) -> None:
        """Picture the scene on show, once it is drawn whole."""
        self._watch_tiles(state, now)
        if now < self._at:
            return
        busy = state.scene.info is not None and not self._viewport.whole
        busy = busy or self._viewport.settling
        self._at = now + SETTLING if busy else NEVER
        if not busy:
            self._remember(state)

    def close(self, state: State, crashed: bool) -> None:
        """Picture what has not rested yet; after a crash nothing is read back."""
        if self._at < NEVER and not crashed:
            with suppress(MemoryError, moderngl.Error):
                self._remember(state)
        self._write.close()

    def follow(self, command: Command, before: State, state: State) -> None:
        """Pictures go that show what is not there any more."""
        match command:
            case OpenScene(path, edits):
                self._reading = path if edits is None else None
            case JobFailed() | JobCancelled():
                self._reading = None
            case HiddenForGood() if command.fits(before):
                self._drop(before)
            case SceneArrived():
                self._arrived(command, before)
            case SceneSaved(path) if state.scene.info is not None:
                self._drop(state)
                self._stamps[state.scene.info.serial] = stamp(path)
            case PictureGone(path):
                self._thumbnails.drop(Kept(scene=path).picture)
            case ForgetRecent():
                for project in set(before.recovery.projects) - set(state.recovery.projects):
                    self._thumbnails.drop(project.picture)
            case _:
                pass
        if set(before.preferences.recent) - set(state.preferences.recent):
            self._write(records.forget_others, state.preferences.recent, PICTURE)
        if _about(before) != _about(state):
            self._at = state.now + REMEMBER_AFTER

    def _arrived(self, command: SceneArrived, before: State) -> None:
        """Of which file the scene is: of that which was read, or that of the scene it goes on from."""
        info, read = command.info, self._reading
        self._reading = None
        if info.path is None:
            return
        if command.replaces and before.scene.info is not None:
            self._stamps.setdefault(info.serial, self._stamps.get(before.scene.info.serial, ""))
        elif command.room is None and read == info.path:
            self._stamps[info.serial] = stamp(info.path)

    def _watch_tiles(self, state: State, now: float) -> None:
        """Show what their files are by now, at once where they come on show."""
        projects_shown = state.recovery.projects if state.scene.info is None and not state.scene.job else ()
        if not projects_shown:
            self._look_at = NEVER
        elif self._look_at == NEVER or now >= self._look_at:
            self._look_at = now + LOOK_AGAIN
            if self._looking is None or self._looking.done():  # a slow disk is not asked twice
                self._looking = self._write(self._renew, projects_shown)

    def _renew(self, shown: tuple[Kept, ...]) -> None:
        """On the writer's thread."""
        for path in (project.scene for project in shown):
            stamped = stamp(Path(path)), stamp(project_file(path, PICTURE))
            if self._tiles.get(path) != stamped:
                self._tiles[path] = stamped
                small = picture(path)
                key = Kept(scene=path).picture
                self._hands.dispatch(PictureGone(path) if small is None else ShowPicture(key, small))

    def _remember(self, state: State) -> None:
        """A scene that has no file, or whose file is not to be remembered, is not pictured."""
        info = state.scene.info
        if info is None or str(info.path) not in state.preferences.recent:
            return
        stamped = self._stamps.get(info.serial, "")
        seen_as = (info.serial, stamped, state.editing.marks, self._viewport.drawn)
        if seen_as == self._last:
            return
        self._last, seen = seen_as, self._viewport.seen()
        if seen is not None and stamped:
            self._write(keep_picture, str(info.path), seen, stamped, failed=NOT_REMEMBERED)

    def _drop(self, state: State) -> None:
        info = state.scene.info
        self._last, self._at = None, state.now + REMEMBER_AFTER
        if info is not None and info.path is not None:
            self._write(drop_picture, str(info.path))


def _about(state: State) -> tuple:
    """What a change of is pictured; compared by what it is made of, since frames ask."""
    return state.scene, state.asking.prompts, state.editing.marks, state.preferences.recent


def stamp(path: Path) -> str:
    """Another text once the file is another; empty where there is none."""
    try:
        seen = path.stat()
    except (OSError, ValueError):
        return ""
    return f"langflash {seen.st_size} {seen.st_mtime_ns}"


def keep_picture(path: str, seen: UInt8[np.ndarray, "H W 3"], stamped: str) -> None:
    """Write the middle of what was seen as the small picture of the file that was so `stamped`; nothing where
    that has become another.

    Raises:
        OutputError: the folder cannot be written.
    """
    if stamped and stamp(Path(path)) == stamped:
        small = ImageOps.fit(Image.fromarray(np.ascontiguousarray(seen)), SIDES, Image.Resampling.BOX)
        for quality in _QUALITIES:
            stream = io.BytesIO()
            small.save(stream, "JPEG", quality=quality, comment=stamped.encode())
            if stream.tell() <= MOST_BYTES:
                file = project_file(path, PICTURE)
                make_folder(file.parent)
                return write_atomically(file, stream.getvalue())
    return drop_picture(path)


def picture(path: str) -> UInt8[np.ndarray, "H W 3"] | None:
    """The small picture of a scene; None, and no file any more, where it is damaged, another's, or older than
    the scene."""
    try:
        with project_file(path, PICTURE).open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
        with opened_picture(content[:MOST_BYTES], ("JPEG",)) as small:
            stamped = bytes(small.info.get("comment", b"")).decode(errors="replace")
            if len(content) <= MOST_BYTES and stamped == stamp(Path(path)) != "" and small.size == SIDES:
                return np.asarray(small.convert("RGB"))
    except Exception:  # whatever Pillow raises for damaged files
        pass
    drop_picture(path)
    return None


def drop_picture(path: str) -> None:
    """Remove the small picture of a scene; none there is fine."""
    with suppress(OSError):
        project_file(path, PICTURE).unlink(missing_ok=True)
