"""The tray on a real ImGui context: double clicks, photos that come back, lenses that were found."""

import math
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch
from imgui_bundle import ImVec2, imgui

from app.window.commands import Command
from app.window.editing import commands as edit
from app.window.frame import layout
from app.window.frame.table import named
from app.window.kit import theme, widgets
from app.window.kit.look import Look
from app.window.recovery.preferences import PANEL_WIDTHS
from app.window.scene import commands as show
from app.window.scene.lenses import found_lens, places
from app.window.scene.panels import tray
from app.window.scene.state import _SAID, PAUSED, Job, Photo, SceneInfo, said
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.base.records import FoundLens
from langflash_core.geometry.cameras import intrinsics_from_fov
from tests.app.window import headless
from tests.app.window.items import Items
from tests.app.window.rows import Rows, clipped
from tests.app.window.scene.test_rooms import Desk
from tests.app.window.scenes import after, room, shown_scene, told
from tests.app.window.test_stumbles import Hands, items, middle

__all__ = ["items"]  # a fixture
FEW, MANY = tuple(Path(f"/p/{k}.jpg") for k in range(2)), tuple(Path(f"/p/{k}.jpg") for k in range(5))


@pytest.mark.parametrize("stage", sorted(_SAID))
def test_what_is_being_done_is_told_in_whole_words(monkeypatch, stage: str) -> None:
    """Beside the buttons and the time that is left "sharpening edges ..." was "sh..."."""
    long = f"{stage}: photo 128 of 300"
    job = Job("Reconstructing", long, 0.5, started=20.0, done=(("photos", 10.0),), pausable=True)
    state = replace(with_photos(MANY).with_scene(job=job), now=100.0)
    rows = Rows(monkeypatch)
    with headless.context((1280, 800)):
        theme.set_up(1.0, "dark")

        def panel(look: Look) -> None:
            imgui.set_next_window_size(ImVec2(PANEL_WIDTHS[0], 600))
            imgui.begin("panel", None, widgets.PLAIN)
            tray.draw(state, look)
            imgui.end()

        headless.frames(panel, headless.look())
        assert said(long) in [row.words for row in rows.now() if not clipped(row)]


def with_photos(paths: tuple[Path, ...]) -> State:
    return after(State(), show.AddPhotos(paths))


def paused() -> State:
    return after(with_photos(MANY), show.Reconstruct(), show.PauseJob(), show.JobCancelled())


def at_work() -> State:
    return after(with_photos(MANY), show.Reconstruct())


class Living:
    """A tray whose commands are followed, as the session does."""

    def __init__(self, state: State) -> None:
        self.state, self.done = state, list[Command]()

    def draw(self, look: Look) -> list[Command]:
        issued = tray.draw(self.state, look)
        for command in issued:
            for each in command.commands if isinstance(command, show.Instead) else (command,):
                self.state = after(self.state, each)
                self.done.append(each)
            if isinstance(command, show.CancelJob):
                self.state = after(self.state, show.JobCancelled())
        return issued


@pytest.mark.parametrize(
    ("begin", "label", "does"),
    [
        (paused, "###reconstruct", show.Reconstruct()),
        (lambda: with_photos(FEW), "###reconstruct", show.Reconstruct()),
        (at_work, "Cancel", show.CancelJob()),
    ],
    ids=["Resume", "Reconstruct", "Cancel"],
)
@pytest.mark.parametrize("slow", [False, True], ids=["", "slow"])
def test_a_double_click_is_one_click(
    begin: Callable[[], State], label: str, does: Command, slow: bool, items: Items
) -> None:
    """The second one fell on what had come there: on "Cancel", which threw away what was kept."""
    living = Living(begin())
    hands = Hands(living.draw, bare=True)
    with headless.context((800, 700)):
        theme.set_up(1.0)
        hands.frames(60)
        if slow:
            imgui.get_io().delta_time = 0.7  # no time of a double click at all, as ImGui counts it
        x, y = middle(items, label)
        hands.click(30, y, times=2)
    assert x > 30 and living.done == [does]


@pytest.mark.parametrize("photos", [(), FEW], ids=["no photo", "two photos"])
def test_cancel_and_find_stand_still_from_stage_to_stage(items: Items, photos: tuple[Path, ...]) -> None:
    resting = with_photos(photos)
    stages = ("starting", "photos", "encoder", "language features", "depth", "poses", "refinement")
    jobs = [resting.with_scene(job=Job("Reconstructing", stage, 0.5)) for stage in stages]
    seen = []
    with headless.context((900, 600)):
        theme.set_up(1.0)
        for state in (resting, *jobs, resting):
            headless.frames(lambda look, state=state: layout.draw_all(state, look), headless.look())
            found = {name.split()[-1]: boxes for name, boxes in items.now().items()}
            seen.append((found.get("Cancel"), found["##text"]))
    before, *during, after_it = seen
    assert during[0][0] is not None and all(each == during[0] for each in during)
    assert before[0] is None and before == after_it


def test_what_has_come_takes_clicks_once_it_is_seen(items: Items) -> None:
    living = Living(paused())
    hands = Hands(living.draw, bare=True)
    with headless.context((800, 700)):
        theme.set_up(1.0)
        hands.frames(60)
        hands.click(*middle(items, "###reconstruct"))
        hands.frames(30)
        hands.click(*middle(items, "Cancel"))
    assert living.done == [show.Reconstruct(), show.CancelJob()]


DARK = "is very dark; take it again with more light"


def with_dark(state: State, *paths: Path) -> State:
    read = (show.PhotoRead(path, None, (f"{path.name} {DARK}",)) for path in paths)
    return after(state, show.AddPhotos(paths), *read)


def test_photos_of_one_name_are_told_apart() -> None:
    (told,) = tray._sentences(with_dark(State(), Path("/a/left.jpg"), Path("/b/left.jpg"), Path("/b/c.jpg")))
    assert told.startswith("Photos 1, 2 and 3 are very dark")


@pytest.mark.parametrize("warnings", [(), (f"left.jpg {DARK}",)], ids=["another photo", "the same"])
def test_what_the_scene_says_of_a_photo_is_said_once(warnings: tuple[str, ...]) -> None:
    """A photo of another room in the tray may have the name of one that the scene on show is made of."""
    state = shown_scene()
    assert state.scene.info is not None
    scene = state.scene.info.scene.with_record(photos=("left.jpg", "right.jpg"), warnings=warnings)
    state = state.with_scene(info=replace(state.scene.info, scene=scene, warnings=warnings))
    told = tray._sentences(with_dark(state, Path("/b/left.jpg")))
    assert [each for each in told if "dark" in each] == [f"left.jpg {DARK}."]


def test_the_space_bar_is_no_click() -> None:
    pressed = []

    def draw(_look: Look) -> list[Command]:
        now = imgui.button("Cancel")
        pressed.append(widgets.takes_clicks("row") and now)
        return []

    hands = Hands(draw, bare=True)
    with headless.context((300, 200)):
        imgui.get_io().config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
        hands.frames(3)
        hands.key(imgui.Key.tab)
        hands.key(imgui.Key.space)
    assert any(pressed)


def test_what_was_kept_outlives_a_cancel_moments_after_resume(tmp_path: Path) -> None:
    photos = tuple(tmp_path / path.name for path in MANY)
    desk = Desk(with_photos(photos))
    desk.perform(show.Reconstruct(), show.PauseJob(), show.JobCancelled())
    assert desk.state.scene.goes_on
    desk.perform(show.Reconstruct())
    desk.state = replace(desk.state, now=desk.state.now + 1.0)
    desk.perform(show.Progressed("photos", 0.1))
    desk.state = replace(desk.state, now=desk.state.now + 1.0)
    desk.perform(show.CancelJob(), show.JobCancelled())
    assert desk.state.scene.goes_on and told(desk.state) == PAUSED
    assert not any(type(each).__name__ == "DropWork" for each in desk.asked)
    desk.perform(show.Reconstruct())
    desk.state = replace(desk.state, now=desk.state.now + 5.0)
    desk.perform(show.CancelJob(), show.JobCancelled())
    assert not desk.state.scene.goes_on and told(desk.state) == "Stopped."
    assert any(type(each).__name__ == "DropWork" for each in desk.asked), "later it is what Cancel says"


def test_esc_while_pausing_loses_nothing(tmp_path: Path) -> None:
    desk = Desk(with_photos(tuple(tmp_path / path.name for path in MANY)))
    desk.perform(show.Reconstruct(), show.PauseJob(), show.CancelJob(), show.JobCancelled())
    assert desk.state.scene.goes_on
    assert not any(type(each).__name__ == "DropWork" for each in desk.asked)


# Photos that come back


def undone(state: State) -> State:
    command = named("Undo").make(state)
    assert command is not None
    return after(state, command)


def paths(state: State) -> tuple[Path, ...]:
    return tuple(photo.path for photo in state.scene.photos)


def test_photos_that_the_choice_of_a_pair_left_out_come_back() -> None:
    chosen = after(with_photos(MANY), show.ChoosePair(), show.PairChosen(MANY, (1, 3)))
    assert paths(chosen) == (MANY[1], MANY[3]) and "Ctrl+Z puts the other 3 back" in told(chosen)
    chosen = after(chosen, show.SetPhotoFov(1, 50.0))
    back = undone(chosen)
    assert paths(back) == MANY and back.scene.photos[3].fov == 50.0 and back.scene.num_taken_out == 0
    working = after(chosen, show.Reconstruct())
    assert named("Undo").make(working) is None and after(working, show.PutPhotosBack()) == working
    assert paths(undone(after(working, show.JobFailed("no")))) == MANY


def test_photos_that_were_taken_out_one_by_one_and_all_come_back() -> None:
    state = after(with_photos(MANY), show.RemovePhoto(0), show.RemovePhoto(2), show.ClearPhotos())
    assert paths(state) == ()
    seen = []
    for _ in range(3):
        state = undone(state)
        seen.append(len(paths(state)))
    assert seen == [3, 4, 5] and paths(state) == MANY and named("Undo").make(state) is None
    added = after(with_photos(MANY), show.ClearPhotos(), show.AddPhotos(FEW))
    assert added.scene.num_taken_out == 0 and after(added, show.PutPhotosBack()) == added


def test_undo_takes_back_what_was_done_last() -> None:
    shown = after(shown_scene(), show.AddPhotos(MANY))
    first = after(shown, edit.SelectAll(), show.RemovePhoto(0))
    assert paths(undone(first)) == MANY and undone(first).editing.num_selected
    then = after(shown, show.RemovePhoto(0), edit.SelectAll())
    assert not undone(then).editing.num_selected and paths(undone(undone(then))) == MANY


def test_the_pair_and_the_way_back_stand_in_the_palette_and_beside_reconstruct(items: Items) -> None:
    pair = named("Keep only the two best photos")
    back = named("Put back the photos that were removed")
    assert pair.make(with_photos(FEW)) is None and back.make(with_photos(FEW)) is None
    assert pair.make(with_photos(MANY)) == show.ChoosePair() and pair.make(at_work()) is None
    living = Living(after(with_photos(MANY), show.ChoosePair(), show.PairChosen(MANY, (1, 3))))
    assert back.make(living.state) == show.PutPhotosBack()
    hands = Hands(living.draw, bare=True)
    with headless.context((800, 700)):
        theme.set_up(1.0)
        hands.frames(60)
        hands.click(*middle(items, "##back"))
    assert living.done == [show.PutPhotosBack()] and paths(living.state) == MANY


# Lenses


def told_info(fov: float, *lenses: FoundLens, photos: tuple[str, ...] = ("0.jpg", "1.jpg")) -> SceneInfo:
    scene = room(torch.eye(3))
    Ks = intrinsics_from_fov(fov, *scene.view_size).expand(2, 3, 3).contiguous()
    scene = replace(scene, Ks=Ks).with_record(
        photos=photos, lens={"found": [asdict(lens) for lens in lenses]}
    )
    return describe_scene(scene, serial=1, name="room")


ASSUMED = FoundLens(69.8, 0.1, 5, 65.0, False)


def test_a_lens_that_was_found_is_said(items: Items) -> None:
    info = told_info(69.8, ASSUMED)
    picture = imgui.ImTextureRef(1), 4 / 3
    look = replace(headless.look(), thumbnails=SimpleNamespace(get=lambda name: picture))
    state = after(with_photos(FEW), show.Reconstruct(), show.SceneArrived(info))
    words = []
    hands = Hands(lambda seen: tray.draw(state, seen), bare=True)
    hands.look = look
    real = imgui.text_wrapped
    with headless.context((800, 700)), pytest.MonkeyPatch.context() as patch:
        patch.setattr(imgui, "text_wrapped", lambda text: (words.append(text), real(text)))
        patch.setattr(imgui, "set_tooltip", words.append)
        theme.set_up(1.0)
        imgui.get_style().hover_flags_for_tooltip_mouse = 0  # at once
        hands.frames(4)
        hands.click(*middle(items, "card"))
    tip = "0.jpg\nField of view 70°, found from the photos, ± 0.1\nClick to set its lens, drag to reorder"
    assert tip in words, "a bare 70° stood on the picture"
    assert "Field of view of the longer side, found from the photos, ± 0.1" in words


def test_a_lens_is_that_of_its_own_photos() -> None:
    wide, photo = FoundLens(90.0, 0.4, 3, 65.0, False), Photo(Path("/p/0.jpg"))

    def found(info: SceneInfo, photo: Photo, aspect: float = 4 / 3) -> FoundLens | None:
        return found_lens(info, places(info), photo, aspect)

    info = told_info(69.8, wide, ASSUMED)
    assert found(info, photo) == ASSUMED
    assert found(info, Photo(Path("/p/7.jpg"))) is None, "it has no place in this scene"
    assert found(told_info(65.0, ASSUMED), photo) is None, "the lens of another size of photos was found"
    assert found(info, replace(photo, recorded=65.0)) is None
    recorded = FoundLens(69.8, 0.1, 5, 68.0, True)
    assert found(told_info(69.8, recorded), replace(photo, recorded=68.0)) == recorded
    broad = math.degrees(2 * math.atan(math.tan(math.radians(69.8) / 2) * (16 / 9) / (4 / 3)))
    assert found(told_info(69.8, replace(ASSUMED, fov=broad)), photo, 16 / 9) is not None, "cropped to 4:3"
    tall = math.degrees(2 * math.atan(math.tan(math.radians(69.8) / 2) * (16 / 9)))
    assert found(told_info(69.8, replace(ASSUMED, fov=tall)), photo, 9 / 16) is not None
    clashing = told_info(69.8, ASSUMED, photos=("a/0.jpg", "p/0.jpg"))
    assert found(clashing, photo) == ASSUMED and found(told_info(69.8), photo) is None


def test_a_record_of_another_kind_tells_no_lens() -> None:
    scene = room(torch.eye(3))
    for lens in ({"found": [{"angle": 3}]}, {"found": [{**asdict(ASSUMED), "fov": "wide"}]}, {}):
        assert describe_scene(scene.with_record(lens=lens), 1, "room").lenses == ()
