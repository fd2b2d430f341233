"""The tray, the export form, the comparison, the layout: what their commands do, without a window."""

import shlex
import signal
import threading
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from app.window import ask_commands as ask
from app.window import commands as do
from app.window import desk_commands as desk
from app.window import export_form
from app.window.export_form import What
from app.window.exporter import Exporter
from app.window.panels.status import fitting
from app.window.panels.widgets import sentence
from app.window.poses import Pose, Vector
from app.window.preferences import PANEL_WIDTHS
from app.window.recovery import Kept
from app.window.state import Mode, Photo, SceneInfo, State
from langflash_core.scene.edits import Atom, History, Marks, Mask
from langflash_core.scene.file import save
from tests.app.window.scenes import room

PATHS = tuple(Path(f"/photos/{name}.jpg") for name in "abc")
VIEWS = (Pose(), Pose(Vector(0.3, 0.0, 0.0)))
WAIT = 60.0  # seconds; an upper bound for a busy machine


def after(state: State, *commands: do.Command) -> State:
    for command in commands:
        state = do.apply(state, command)
    return state


def told(state: State) -> str:
    """The newest message."""
    return state.toasts[-1].text


def scene(path: Path | None = Path("/rooms/my room.langflash")) -> State:
    """A state with a scene of two views and the phrase "door"."""
    info = SceneInfo(
        serial=1, name="room", scene=room(torch.eye(3)), views=VIEWS, num_gaussians=3, num_atoms=3,
        space="minilm", path=path, extent=(Vector(-1.0, -1.0, 0.0), Vector(1.0, 1.0, 2.0)),
    )  # fmt: skip
    return after(State(), do.SceneArrived(info), do.EditPrompt(0, "door"))


def form(state: State, **changes) -> State:
    return after(state, desk.EditForm(replace(state.desk.form, **changes)))


# The tray


def test_photos_take_a_lens_notes_and_another_place() -> None:
    state = after(State(), do.AddPhotos(PATHS), desk.PhotoRead(PATHS[1], 50.0, ("it is dark",)))
    state = after(state, desk.SetPhotoFov(0, 500.0), desk.MovePhoto(2, 0), desk.MovePhoto(9, 0))
    assert [photo.path.stem for photo in state.photos] == ["c", "a", "b"]
    fov = state.photos[1].fov
    assert fov is not None and 0 < fov < 180  # within what a lens can have
    assert (state.photos[2].recorded, state.photos[2].notes) == (50.0, ("it is dark",))
    state = after(state, desk.SetPhotoFov(1, None))
    assert state.photos[1].fov is None


def test_the_best_pair_keeps_two_and_is_dropped_when_the_tray_has_changed() -> None:
    two = after(State(), do.AddPhotos(PATHS[:2]), desk.ChoosePair())
    assert not two.desk.choosing and "three photos" in told(two)
    state = after(State(), do.AddPhotos(PATHS), desk.ChoosePair())
    assert state.desk.choosing
    chosen = after(state, desk.PairChosen(PATHS, (0, 2)))
    assert [photo.path for photo in chosen.photos] == [PATHS[0], PATHS[2]] and not chosen.desk.choosing
    changed = after(state, do.RemovePhoto(0), desk.PairChosen(PATHS, (0, 2)))
    assert len(changed.photos) == 2 and changed.toasts == ()
    assert "No two of these photos match" in told(after(state, desk.PairChosen(PATHS, None)))
    assert told(after(state, desk.ChoosingFailed("It is damaged."))) == "It is damaged."


# Moving and layout


def test_all_of_the_scene_is_framed_and_a_photo_compared() -> None:
    assert after(State(), desk.FrameAll()) == State()
    framed = after(scene(), desk.FrameAll())
    assert framed.flight is not None and framed.flight.end.centre.z < 0  # stands back
    assert after(scene(), desk.Compare(1.5)).desk.compare == 1.0
    assert after(scene(), desk.Compare(None)).desk.compare is None


def test_the_layout_is_kept_within_its_limits() -> None:
    wanted = replace(State().desk.preferences, panel_width=9999.0, dictionary=(1, 2, 380, 300))
    state = after(State(), desk.Prefer(wanted), ask.OpenDictionary(True))
    kept = state.desk.preferences
    assert (kept.panel_width, kept.dictionary, kept.dictionary_open) == (
        PANEL_WIDTHS[1],
        (1, 2, 380, 300),
        True,
    )


def test_the_status_bar_shows_what_fits() -> None:
    assert [fitting([30, 20, 10], 5, room) for room in (0, 30, 55, 69, 70)] == [0, 1, 2, 2, 3]


def test_recent_files_begin_with_the_newest() -> None:
    state = after(State(), desk.Opened(Path("/a")), desk.Opened(Path("/b")), desk.Opened(Path("/a")))
    assert state.desk.preferences.recent == ("/a", "/b")
    assert after(state, desk.ForgetRecent()).desk.preferences.recent == ()


# Export


@pytest.mark.parametrize("what", What)
def test_every_kind_says_the_command_that_does_it(what: What) -> None:
    state = form(scene(), what=what, path="/out/a picture")
    order = export_form.order(state)
    assert not isinstance(order, str)
    words = shlex.split(order.line)
    assert words[:5] == [
        "langflash",
        "export",
        "/rooms/my room.langflash",
        "-o",
        f"/out/a picture{what.suffix}",
    ]
    assert ("--prompt" in words) == what.needs_phrases and ("--view" in words) == what.looks
    assert ("--size" in words) == what.sized and ("--seconds" in words) == (what is What.VIDEO)


def wrong(state: State) -> str:
    """What the form lacks."""
    order = export_form.order(state)
    assert isinstance(order, str), order
    return order


def test_what_is_missing_is_said() -> None:
    assert "no scene" in wrong(State())
    assert "file name" in wrong(form(scene(), path=" "))
    assert "is the scene itself" in wrong(form(scene(), what=What.SCENE, path="/rooms/my room"))
    silent = after(scene(), do.EditPrompt(0, ""))
    assert "needs a phrase" in wrong(form(silent, what=What.MASK, path="/x"))
    assert "no phrase to keep" in wrong(form(silent, what=What.PLY, only_found=True, path="/x"))
    assert "save it first" in wrong(form(scene(None), path="/x"))


def test_the_view_on_show_a_camera_of_its_own_or_all_photos() -> None:
    state = form(after(scene(), do.JumpTo(1)), path="/out/x.png")
    order = export_form.order(state)
    assert not isinstance(order, str) and order.words[order.words.index("--view") + 1] == "1"
    moved = export_form.order(after(state, do.MoveTo(Pose(Vector(0.0, 0.0, -1.0)))))
    assert not isinstance(moved, str) and moved.camera_file == Path("/out/x.camera.json")
    every = export_form.order(form(state, all_views=True))
    assert not isinstance(every, str) and "--all-views" in every.words and every.camera_file is None


def test_a_new_kind_takes_its_own_ending_and_an_unsaved_scene_its_copy() -> None:
    state = form(form(scene(), path="/out/x.png"), what=What.VIDEO)
    assert state.desk.form.path == "/out/x.mp4"
    state = form(after(scene(None), desk.CopyAt(Path("/state/copy.langflash"))), path="/x")
    order = export_form.order(state)
    assert not isinstance(order, str) and order.words[1] == "/state/copy.langflash"
    assert "copy" in export_form.remarks(state)[0]


def test_unsaved_edits_and_a_selection_are_read_from_their_copies() -> None:
    plain = scene()
    marks = Marks.untouched(8, 3)
    selected = replace(marks, selected=Mask.full(8), atoms=(Atom(0, "sofa"), *marks.atoms[1:]))
    editing = replace(plain.editing, history=History(selected), saved=marks)
    state = form(replace(plain, editing=editing), what=What.PLY, path="/x")
    assert state.editing.unsaved and "save it first" in str(export_form.order(state))  # before the copies
    state = after(state, desk.CopiesAt(Path("/s/edited.langflash"), Path("/s/selection.langflash")))
    order = export_form.order(state)
    assert not isinstance(order, str) and order.words[1] == "/s/edited.langflash"
    assert "edits are not saved" in export_form.remarks(state)[0]
    state = form(state, only_selected=True)
    order = export_form.order(state)
    assert not isinstance(order, str) and order.words[1] == "/s/selection.langflash"
    assert "selection is not saved" in export_form.remarks(state)[0]
    nothing = replace(state.editing, history=History(marks))
    again = after(replace(state, editing=nothing), desk.ShowExport())
    assert not again.desk.form.only_selected and again.dialog == "export"


def test_an_export_is_followed_to_its_end() -> None:
    state = after(scene(), desk.ShowExport(), desk.ExportBegan(Path("/x.png")))
    assert state.dialog is None and state.desk.exporting is not None
    state = after(state, desk.ExportProgressed("drawing", 1.5))
    assert state.desk.exporting is not None and state.desk.exporting.fraction == 1.0
    assert told(after(state, desk.ExportEnded(0, "/x.png", ""))) == "Exported /x.png"
    assert told(after(state, desk.ExportEnded(2, "", "no room on the disk"))) == "no room on the disk"
    stopped = after(state, desk.CancelExport(), desk.ExportEnded(130, "", ""))
    assert stopped.desk.exporting is None and "nothing was written" in told(stopped)
    assert "no scene" in told(after(State(), desk.ShowExport()))


class Export:
    """One export by the real command, with what it said."""

    def __init__(self, *words: str) -> None:
        self.ended, self.began = threading.Event(), threading.Event()
        self.result: tuple = ()
        self.exporter = Exporter(lambda *_: self.began.set(), self._end)
        self.exporter.start(("export", *words))

    def _end(self, *result) -> None:
        self.result = result
        self.ended.set()


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("desk") / "room.langflash"
    save(room(torch.eye(3)), path)
    return path


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("no room on the disk", "No room on the disk."),
        ("The export cannot be started.", "The export cannot be started."),
        ("Stopped.", "Stopped."),
        ("photo.jpg is damaged; copy it again", "photo.jpg is damaged; copy it again."),
        ("/tmp/set is larger than a prompt set can be", "/tmp/set is larger than a prompt set can be."),
    ],
)
def test_problems_are_shown_as_sentences(said: str, shown: str) -> None:
    assert sentence(said) == shown


def test_a_real_export_writes_its_file(scene_file: Path, tmp_path: Path) -> None:
    export = Export(str(scene_file), "-o", str(tmp_path / "out.ply"))
    assert export.ended.wait(WAIT) and export.result[0] == 0, export.result
    assert str(tmp_path / "out.ply") in export.result[1] and (tmp_path / "out.ply").stat().st_size > 1000


def test_a_cancelled_export_leaves_nothing(scene_file: Path, tmp_path: Path) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as in a window that a shell put in the background
    try:
        words = ("--size", "1600x1200", "--seconds", "60")
        export = Export(str(scene_file), "-o", str(tmp_path / "out.mp4"), *words)
    finally:
        signal.signal(signal.SIGINT, before)
    assert export.began.wait(WAIT)
    export.exporter.cancel()
    assert export.ended.wait(WAIT) and export.result[0] == 130, export.result
    assert list(tmp_path.iterdir()) == []


# A session that ended badly


def test_a_restored_session_has_its_photos_phrases_camera_and_mode() -> None:
    pose = Pose(Vector(0.0, 0.5, 0.0))
    kept = Kept(photos=("/p/a.jpg",), fovs=(60.0,), phrases=("door", "rug"), mode="DEPTH", pose=pose)
    state = after(State(), desk.OfferSession(kept), desk.EndSessionOffer(restore=True))
    assert [photo.fov for photo in state.photos] == [60.0] and state.desk.offer is None
    assert [prompt.text for prompt in state.prompts] == ["door", "rug"]
    assert after(state, desk.StandAgain(pose, "DEPTH", "kitchen", False)) == state  # no scene yet
    info = scene().info
    assert info is not None
    shown = after(state, do.SceneArrived(info), desk.StandAgain(pose, "DEPTH", "kitchen", False))
    assert shown.mode is Mode.DEPTH and shown.pose == pose and shown.view is None
    assert shown.info is not None and (shown.info.name, shown.info.path) == ("kitchen", None)
    turned_down = after(State(), desk.OfferSession(kept), desk.EndSessionOffer(restore=False))
    assert turned_down == State()


def test_an_export_never_replaces_a_photo() -> None:
    """Neither by the name it offers, nor by one that is typed, nor by one of several views' files."""
    photos = (Photo(Path("/p/left.png")), Photo(Path("/p/left_1.png")))
    state = replace(scene(None), photos=photos)
    state = after(state, desk.CopyAt(Path("/state/copy.langflash")), desk.ShowExport())
    assert state.desk.form.path == "/p/left_view.png"
    assert not isinstance(export_form.order(state), str)
    for path in ("/p/left.png", "/p/left"):
        assert "photo" in str(export_form.order(form(state, path=path)))
    views = form(state, path="/p/left.png", all_views=True)
    assert "photo" in str(export_form.order(replace(views, photos=photos[1:])))
