"""What the scene asks of the world: paths from the disk, the worker's jobs, the scene in the renderer."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace

from langflash_core.base.colormaps import colour_bar
from langflash_core.base.formats import COLOUR_MAPS
from langflash_core.errors import LangFlashError
from langflash_core.geometry.poses import Vector
from langflash_core.reconstruction.networks import Networks

from ..commands import Command, Notify
from ..dialogs import Dialog
from ..editing.placing import SetHandle
from ..editing.state import Handle, Point
from ..effects import Effects, Hands
from ..kit.textures import Thumbnails
from ..opening.commands import OpenFilm, films_of
from ..state import State
from ..viewport import Viewport
from .camera import FrameAll, HoldPlace, TakeHold
from .commands import (
    AddPhotos,
    All,
    AskAboutDrop,
    CancelJob,
    ChoosePair,
    GoOn,
    GoToRoom,
    Instead,
    Loaded,
    OpenPaths,
    OpenScene,
    PauseJob,
    Reconstruct,
    SaveScene,
    SceneArrived,
    SceneSaved,
    Thinned,
    dropped,
)
from .drops import sort_drop, told_few
from .merging import AddToScene, Merged, MergeScene
from .standing import LevelScene
from .state import WHOLE, WHOLE_PHOTOS, SceneInfo
from .unfinished import FEWEST
from .work import (
    DrawAbove,
    DropWork,
    FindPair,
    FindWorld,
    JoinScenes,
    LoadScene,
    LookForWork,
    MakeThumbnails,
    PutInPhotos,
    ReconstructPhotos,
    ShowPhotos,
    Thin,
    ThinAround,
    WriteScene,
)


class SceneEffects(Effects):
    """entitle: gives the window a title."""

    def __init__(
        self, hands: Hands, viewport: Viewport, thumbnails: Thumbnails, entitle: Callable[[str], None]
    ) -> None:
        self._hands = hands
        self._viewport = viewport
        self._thumbnails = thumbnails
        self._entitle = entitle
        self._networks = Networks()

    def follow(self, command: Command, before: State, state: State) -> None:
        """Jobs and tasks of the worker; a scene that has come goes to the renderer."""
        submit, info, marks = self._hands.submit, state.scene.info, state.editing.marks
        match command:
            case OpenPaths(paths, was_dropped):
                self._open(paths, was_dropped, state)
            case MergeScene(path) if info is not None and marks is not None:
                submit(JoinScenes(info, marks, path))
            case AddToScene(photos) if info is not None and marks is not None:
                submit(PutInPhotos(info, marks, photos, self._networks))
            case AddPhotos(paths):
                submit(MakeThumbnails(paths))
            case Reconstruct() if state.scene.photos:
                paths, fovs = state.scene.paths, tuple(photo.fov for photo in state.scene.photos)
                detail, films = state.preferences.detail, films_of(state)
                submit(ReconstructPhotos(paths, fovs, detail, films, self._networks))
            case OpenScene(path, edits, alone):
                submit(LoadScene(path, edits, alone))
            case SaveScene(path) if info is not None:
                submit(WriteScene(info.scene, path, marks))
            case LevelScene() if info is not None and marks is not None:
                submit(FindWorld(info.serial, info.memory, marks))
            case CancelJob() | PauseJob():
                self._end_job(state)
            case ChoosePair() if state.scene.choosing and not before.scene.choosing:
                submit(FindPair(state.scene.paths))
            case SceneArrived(arrived, replaces=changed):
                self._show(arrived, before.scene.info, changed, state)
            case Thinned(scene, share, thinned, around):
                self._viewport.thin(scene, share, thinned, around)
            case TakeHold(at):
                self._hold(at)
            case Loaded() if info is None and self._viewport.warm():
                self._hands.dispatch(Loaded())
            case _:
                self._go_on(command, before, state)
        self._look_for_work(before, state)
        self._show_whole(before, state)
        self._draw_as_preferred(before, state)

    def after_picture(self, state: State) -> None:
        self._choose_around(state)

    def _choose_around(self, state: State) -> None:
        """What moves through a huge scene is chosen anew where the camera has come far."""
        info, eye = state.scene.info, state.scene.pose.centre
        share = None if info is None else self._viewport.share_around(eye)
        if info is not None and share is not None:
            self._hands.submit(ThinAround(info.serial, info.memory, share, eye))

    def _hold(self, at: Point) -> None:
        """A hand turns the scene around what the picture shows under it."""
        found = self._viewport.read(at)
        if found is not None and found[0].point is not None:
            self._hands.perform(HoldPlace(Vector(*found[0].point)))

    def _end_job(self, state: State) -> None:
        """A job that is paused keeps its work, one that is cancelled does not."""
        self._hands.cancel()
        job = state.scene.job
        if job is not None and job.pausable and not job.pausing:
            self._hands.submit(DropWork(state.scene.paths))

    def _look_for_work(self, before: State, state: State) -> None:
        """Other photos in the tray may be ones on which work was begun."""
        paths = state.scene.paths
        if paths != before.scene.paths and len(paths) >= FEWEST and state.scene.job is None:
            self._hands.submit(LookForWork(paths))

    def _go_on(self, command: Command, before: State, state: State) -> None:
        """Commands that stand for others."""
        waited: Sequence[Command] = ()
        match command:
            case Instead() if state.dialog is None:
                self._hands.perform(GoOn())
            case SceneSaved() if before.scene.pending:
                self._hands.perform(GoOn())
            case GoOn():
                waited = before.scene.pending
            case All(commands):
                waited = commands
            case Merged(gone=gone) if gone is not None and command.fits(before):
                told = [Notify(command.said, "info")] if command.said else []
                waited = [command.arrival(before), *told]
            case Merged(copied=True) if command.fits(before):
                waited = [command.arrival(before), SetHandle(Handle.MOVE)]
            case Merged() if command.fits(before):
                waited = [command.arrival(before), SetHandle(Handle.MOVE), FrameAll()]
            case GoToRoom(serial):
                rooms = (room for room in state.scene.rooms if room.info.serial == serial)
                waited = [SceneArrived(replace(r.info, history=r.history), room=r) for r in rooms]
            case _:
                pass
        for each in waited:
            self._hands.perform(each)

    def _draw_as_preferred(self, before: State, state: State) -> None:
        wanted = state.preferences.rasteriser
        if wanted != before.preferences.rasteriser:
            self._viewport.draw_with(wanted)

    def _show_whole(self, before: State, state: State) -> None:
        """Of many photos the one that the scene is compared with, whole."""
        view, info = state.scene.view, state.scene.info
        if info is None or view is None or state.scene.compare is None:
            return
        known = before.scene.info is info and before.scene.view == view and before.scene.compare is not None
        if WHOLE_PHOTOS < len(info.scene.photos) > view and not known:
            with suppress(OSError):
                self._thumbnails.put_encoded(WHOLE, info.scene.photos[view])

    def _open(self, paths: Sequence[str], was_dropped: bool, state: State) -> None:
        perform = self._hands.perform
        drop = sort_drop(paths)
        for sentence in told_few(drop.rejected):
            perform(Notify(sentence))
        if drop.films:
            perform(OpenFilm(drop.films[0]))
        if len(drop.films) > 1:
            perform(Notify(f"Only {drop.films[0].name} was opened; open one film at a time."))
        if drop.scenes and (drop.photos or drop.films):
            came = "photos" if drop.photos else "a film"
            perform(
                Notify(f"{drop.scenes[0].name} was not opened, since {came} came with it; open it alone.")
            )
        elif len(drop.scenes) > 1:
            perform(Notify(f"Only {drop.scenes[0].name} was opened; open one scene at a time."))
        if drop.photos and state.scene.info is not None:
            perform(AskAboutDrop(drop.photos, Dialog.DROP))
        elif drop.photos and drop.films:
            perform(AddPhotos(drop.photos))
        elif drop.photos:
            perform(dropped(state, drop.photos, new=False))
        elif drop.scenes and was_dropped and state.scene.info is not None:
            perform(AskAboutDrop(drop.scenes[:1], Dialog.DROP_SCENE))
        elif drop.scenes and not drop.films:
            perform(Instead((OpenScene(drop.scenes[0], alone=True),)))

    def _show(self, info: SceneInfo, old: SceneInfo | None, changed: bool, state: State) -> None:
        """Bring a scene to the renderer; the worker makes what moves through it, then decodes its photos, of
        which many take longer than a frame. No photo of the `old` one stays on a button of another's."""
        try:
            self._viewport.set_scene(info.serial, info.scene, changed)
        except LangFlashError as error:  # what OpenGL cannot do
            self._hands.perform(Notify(str(error)))
        self._choose_around(state)
        for share in self._viewport.shares:
            self._hands.submit(Thin(info.serial, info.scene, share))
        photos = () if old is None else old.scene.photos
        if photos != info.scene.photos:
            for index in range(len(photos)):
                self._thumbnails.drop(f"view {index}")
        if info.scene.photos:
            self._hands.submit(ShowPhotos(info.serial, info.scene.photos))
        if info.above is not None:
            self._hands.submit(DrawAbove(info.serial, info.scene, info.above))
        for colormap in COLOUR_MAPS:
            self._thumbnails.put(f"bar {colormap}", colour_bar(colormap))
        self._entitle(f"{info.name} - LangFlash")
