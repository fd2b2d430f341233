"""Remembers scenes as they are left, and opens them so again.

A moment after the last change the record of the scene on show is written, and what is seen of it as a small
picture, by a thread of one. No picture is kept of what is not, or not yet, in the scene's file: of a scene
that nobody saved, or in which something was hidden for good. While tiles are on show their files are looked
at again: another process may hide something in one of them.
"""

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from langflash_core.errors import LangFlashError

from ..commands import Command, Log, ShowPicture
from ..editing.mending import HiddenForGood
from ..effects import Effects, Hands
from ..kit.textures import Thumbnails
from ..scene.commands import (
    Instead,
    JobCancelled,
    JobFailed,
    OpenPaths,
    OpenScene,
    SceneArrived,
    SceneSaved,
)
from ..scene.work import MakeThumbnails
from ..state import State
from ..viewport import Viewport
from . import projects
from .commands import ForgetRecent, GoOnWith, OpenProject, PictureGone, StandAsLeft, kept_session
from .state import Kept, Project
from .work import ReadProjects

REMEMBER_AFTER = 1.0  # seconds without a change, so that a burst is once
SETTLING = 0.5  # seconds until a picture that is still being drawn is asked for again
LOOK_AGAIN = 1.0  # seconds between two looks at the files of tiles
NEVER = float("inf")


class RememberingEffects(Effects):
    """The one writer of projects. viewport: what is seen; thumbnails: of the projects on show."""

    def __init__(self, hands: Hands, viewport: Viewport, thumbnails: Thumbnails) -> None:
        self._hands = hands
        self._viewport = viewport
        self._thumbnails = thumbnails
        self._writer = ThreadPoolExecutor(1, thread_name_prefix="langflash-projects")
        self._reading: Path | None = None  # the file whose scene is to come
        self._wanted: Kept | None = None  # and how that was left
        self._stamps: dict[int, str] = {}  # of scenes by their number: the file that they are in
        self._last: tuple | None = None  # what was remembered last
        self._at = NEVER
        self._looking: Future | None = None  # at the files of the tiles on show
        self._look_at = NEVER
        self._tiles: dict[str, tuple[str, str]] = {}  # stamps of what they show; the writer's thread alone

    def begin(self, recent: tuple[str, ...]) -> None:
        """Look for what is remembered of these scenes."""
        self._hands.submit(ReadProjects(recent))

    @property
    def due(self) -> float:
        """When what has changed has rested long enough, or tiles are looked at again."""
        return min(self._at, self._look_at)

    def tick(self, state: State, now: float) -> None:
        """Remember the scene on show, once its picture is whole."""
        self._watch_tiles(state, now)
        if now < self._at:
            return
        busy = state.scene.info is not None and not self._viewport.whole
        busy = busy or self._viewport.settling
        self._at = now + SETTLING if busy else NEVER
        if not busy:
            self._remember(state)

    def close(self, state: State, crashed: bool) -> None:
        """Remember what has not rested yet."""
        if self._at < NEVER:
            self._remember(state)
        self._writer.shutdown()

    def follow(self, command: Command, before: State, state: State) -> None:
        """Projects are opened, and pictures go that show what is not there any more."""
        match command:
            case OpenProject(path):
                known = os.path.isfile(path)
                kept = projects.read(path).kept
                self._hands.perform(Instead((GoOnWith(kept),)) if known else OpenPaths((path,)))
            case GoOnWith(kept):
                self._hands.perform(OpenScene(Path(kept.scene), alone=True))
                self._wanted = kept
            case OpenScene(path, edits):
                self._reading, self._wanted = path if edits is None else None, None
            case JobFailed() | JobCancelled():
                self._reading = self._wanted = None
            case StandAsLeft(kept) if kept.photos:
                self._hands.submit(MakeThumbnails(tuple(map(Path, kept.photos))))
            case HiddenForGood() if command.fits(before):
                self._drop_picture(before)
            case SceneArrived():
                self._arrived(command, before)
            case SceneSaved(path) if state.scene.info is not None:
                self._drop_picture(state)
                self._stamps[state.scene.info.serial] = projects.stamp(path)
            case PictureGone(path):
                self._thumbnails.drop(Project(path).picture)
            case ForgetRecent():
                for project in set(before.recovery.projects) - set(state.recovery.projects):
                    self._thumbnails.drop(project.picture)
            case _:
                pass
        if set(before.preferences.recent) - set(state.preferences.recent):
            self._write(lambda: projects.sweep(state.preferences.recent))
        if _about(before) != _about(state):
            self._at = state.now + REMEMBER_AFTER

    def _arrived(self, command: SceneArrived, before: State) -> None:
        """Of which file the scene is: of that which was read, or that of the scene it goes on from."""
        info, read, kept = command.info, self._reading, self._wanted
        self._reading = self._wanted = None
        if info.path is None:
            return
        if command.replaces and before.scene.info is not None:
            self._stamps.setdefault(info.serial, self._stamps.get(before.scene.info.serial, ""))
        elif command.room is None and read == info.path:
            self._stamps[info.serial] = projects.stamp(info.path)
        if kept is not None and kept.scene == str(info.path):
            self._hands.perform(StandAsLeft(kept))

    def _watch_tiles(self, state: State, now: float) -> None:
        """Show what their files are by now, at once where they come on show."""
        projects_shown = state.recovery.projects if state.scene.info is None and not state.scene.job else ()
        if not projects_shown:
            self._look_at = NEVER
        elif self._look_at == NEVER or now >= self._look_at:
            self._look_at = now + LOOK_AGAIN
            if self._looking is None or self._looking.done():  # a slow disk is not asked twice
                self._looking = self._write(lambda: self._renew(projects_shown))

    # What the writer's thread does

    def _renew(self, shown: tuple[Project, ...]) -> None:
        for project in shown:
            stamped = projects.stamps(project.path)
            if self._tiles.get(project.path) == stamped:
                continue
            self._tiles[project.path] = stamped
            small = projects.picture(project.path)
            known = PictureGone(project.path) if small is None else ShowPicture(project.picture, small)
            self._hands.dispatch(known)

    def _remember(self, state: State) -> None:
        project = _project(state)
        if project is None or state.scene.info is None:
            return
        seen_as = (project, state.editing.marks, self._viewport.drawn)
        if seen_as == self._last:
            return
        self._last = seen_as
        self._write(lambda: projects.keep(project.kept, project.views))
        stamped, seen = self._stamps.get(state.scene.info.serial, ""), self._viewport.seen()
        if seen is not None and stamped:
            self._write(lambda: projects.keep_picture(project.path, seen, stamped))

    def _drop_picture(self, state: State) -> None:
        info = state.scene.info
        self._last, self._at = None, state.now + REMEMBER_AFTER
        if info is not None and info.path is not None:
            path = str(info.path)
            self._write(lambda: projects.drop_picture(path))

    def _write(self, work: Callable[[], object]) -> Future:
        return self._writer.submit(self._written, work)

    def _written(self, work: Callable[[], object]) -> None:
        try:
            work()
        except LangFlashError as error:
            self._hands.dispatch(Log("error", f"What was open could not be remembered: {error}."))


def _project(state: State) -> Project | None:
    """The scene on show as it is now; None where it has no file, or its file is not to be remembered."""
    info = state.scene.info
    if info is None or info.path is None or str(info.path) not in state.preferences.recent:
        return None
    aside = state.scene.aside
    own = state if aside is None else state.with_scene(photos=aside)
    return Project(str(info.path), kept_session(own, info.path), len(info.views))


def _about(state: State) -> tuple:
    """What a change of is remembered; compared by what it is made of, since frames ask."""
    return state.scene, state.asking.prompts, state.editing.marks, state.preferences.recent
