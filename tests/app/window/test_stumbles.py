"""What people stumbled on who tried the window for the first time, on a real ImGui context."""

import re
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from imgui_bundle import ImVec2, imgui

from app.window.asking.panels import known, prompts, scores
from app.window.commands import Command, ShowDialog, apply
from app.window.dialogs import Dialog
from app.window.editing import commands as edit
from app.window.editing import pointing as point
from app.window.editing.panels import pointing as card_panel
from app.window.editing.panels import ruler, tools
from app.window.editing.state import Card, Editing, Reading, Tool
from app.window.exporting import commands as export
from app.window.exporting.state import Running
from app.window.filming import commands as film
from app.window.frame import dialogs, keys, layout
from app.window.frame.table import named
from app.window.kit.look import Look
from app.window.opening import commands as opening
from app.window.opening.panels import browser
from app.window.opening.state import Folder
from app.window.opening.work import ReadFolder, SampleTiles
from app.window.scene import commands as show
from app.window.scene.camera import Orbit
from app.window.scene.commands import Loaded
from app.window.scene.panels import views
from app.window.scene.state import said
from app.window.state import State
from app.window.worker import Worker
from langflash_core.base import outputs
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.pointmaps import PointMapNet
from langflash_core.reconstruction.stages import STAGES
from tests.app.window.headless import box, context, frames, look
from tests.app.window.items import Items
from tests.app.window.scenes import after, shown_scene, with_info

SIZE = (1280, 800)
PATIENCE = 60.0  # seconds
PLACE, ROOM = ImVec2(348, 52), ImVec2(932, 716)
Panel = Callable[[Look], list[Command]]


class Hands:
    """A panel in frames, and what was issued; drawn inside a window of its own where it has none."""

    def __init__(self, draw: Panel, bare: bool = False) -> None:
        self.issued: list[Command] = []
        self._draw, self._bare = draw, bare
        self.look = look()

    def frames(self, count: int = 2) -> None:
        def panel(seen: Look) -> None:
            if self._bare:
                imgui.set_next_window_pos(ImVec2(0, 0))
                imgui.set_next_window_size(ImVec2(760, 600))
                imgui.begin("panel")
            self.issued += self._draw(seen)
            if self._bare:
                imgui.end()

        frames(panel, self.look, count)

    def click(self, x: float, y: float, times: int = 1) -> None:
        io = imgui.get_io()
        io.add_mouse_pos_event(x, y)
        self.frames()
        for _ in range(times):
            for down in (True, False):
                io.add_mouse_button_event(0, down)
                self.frames(1)
        self.frames()

    def key(self, key: imgui.Key) -> None:
        for down in (True, False):
            imgui.get_io().add_key_event(key, down)
            self.frames()

    def of(self, kind: type[Command]) -> list[Command]:
        return [command for command in self.issued if isinstance(command, kind)]


@pytest.fixture
def items(monkeypatch) -> Items:
    for name in ("button", "selectable", "input_text", "input_text_with_hint"):
        monkeypatch.setattr(imgui, name, getattr(imgui, name))  # as it was, afterwards
    return Items()


def middle(items: Items, label: str) -> tuple[float, float]:
    left, top, right, bottom = next(boxes[0] for name, boxes in items.now().items() if name.endswith(label))
    return (left + right) / 2, (top + bottom) / 2


def browsing(folder: Folder) -> State:
    return replace(State().with_opening(folder=folder), dialog=Dialog.OPEN)


def test_a_double_click_walks_into_one_folder(items: Items) -> None:
    """The second click would fall on what the first one brought under the pointer."""
    states = [browsing(Folder(Path("/home"), (Path("/home/Pictures"),)))]
    hands = Hands(lambda seen: browser.draw(states[-1], seen), bare=True)
    with context(SIZE):
        hands.frames(4)
        x, y = middle(items, "##/home/Pictures")
        hands.click(x, y)
        states.append(browsing(Folder(Path("/home/Pictures"), (Path("/home/Pictures/toys"),))))
        hands.click(x, y)
        assert hands.of(opening.LookInto) == [opening.LookInto(Path("/home/Pictures"))]
        for _ in range(30):  # half a second later a click is one of its own
            hands.frames(1)
        hands.click(x, y)
    assert hands.of(opening.LookInto)[1:] == [opening.LookInto(Path("/home/Pictures/toys"))]


def test_keys_walk_through_folders_and_open_what_the_space_bar_has_chosen() -> None:
    """No way leads from the photos to the button by arrows alone that does not pass "Cancel"."""
    photos = (Path("/home/Pictures/a.png"), Path("/home/Pictures/b.png"))
    states = [browsing(Folder(Path("/home"), (Path("/home/Pictures"),)))]
    hands = Hands(lambda seen: browser.draw(states[-1], seen), bare=True)
    with context(SIZE):
        imgui.get_io().config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
        hands.frames(4)
        for _ in range(10):
            hands.key(imgui.Key.down_arrow)
            hands.key(imgui.Key.enter)
            if hands.of(opening.LookInto)[-1:] == [opening.LookInto(Path("/home/Pictures"))]:
                break
        assert hands.of(opening.LookInto)[-1:] == [opening.LookInto(Path("/home/Pictures"))]
        states.append(browsing(Folder(Path("/home/Pictures"), (), photos)))
        hands.frames(4)
        hands.key(imgui.Key.space)
        assert hands.of(opening.Choose) == [opening.Choose(photos[0])]
        states.append(apply(states[-1], opening.Choose(photos[0])))
        hands.key(imgui.Key.right_arrow)
        hands.key(imgui.Key.enter)
    assert hands.of(show.OpenPaths) == [show.OpenPaths(tuple(map(str, photos)))]
    assert hands.of(ShowDialog) == []


def test_a_card_is_asked_again_once_its_thing_has_another_name(items: Items) -> None:
    state = shown_scene()
    card = Card(Reading((300, 200), None, 1.0, ((1, 1.0),)), (("tv stand", 0.93),))
    state = state.with_editing(card=card, names=(("a",),) * 3)
    hands = Hands(lambda seen: card_panel.draw(state, seen, PLACE, ROOM))
    with context(SIZE):
        hands.frames(4)
        hands.click(*middle(items, "##name"))
        imgui.get_io().add_input_characters_utf8("armchair")
        hands.frames()
        hands.key(imgui.Key.enter)
    assert hands.of(edit.RenameAtom) == [edit.RenameAtom(1, "armchair")]
    assert hands.of(point.Ask) == [point.Ask((300, 200))]


@pytest.mark.parametrize("asker", [Dialog.EXPORT, Dialog.SAVE])
def test_a_file_is_written_to_a_folder_that_was_walked_to(asker: Dialog, items: Items) -> None:
    first = export.ShowExport() if asker is Dialog.EXPORT else ShowDialog(Dialog.SAVE)
    states = [after(shown_scene(), first)]
    hands = Hands(lambda seen: dialogs.draw(states[-1], seen))

    def wanted() -> str:
        return states[-1].exporting.form.path if asker is Dialog.EXPORT else states[-1].typed.text

    with context(SIZE):
        hands.frames(6)
        before = Path(wanted())
        hands.click(*middle(items, "##folder"))
        look_at = opening.LookInto(Path("/home"), dialog=Dialog.PLACE)
        read = opening.FolderRead(Folder(Path("/home"), (Path("/home/out"),), (Path("/home/a.png"),)))
        assert hands.of(opening.LookForPlace) == [opening.LookForPlace()]
        waiting = states[-1].with_scene(pending=(show.Reconstruct(),))
        states.append(after(waiting, opening.LookForPlace(), look_at, read))
        hands.frames(6)
        assert not any(name.endswith("a.png") for name in items.now())  # a photo is no place
        hands.click(*middle(items, "Write here"))
        assert hands.of(opening.PlaceFound) == [opening.PlaceFound(Path("/home"))]
        back = opening.PlaceFound(None).apply(states[-1])
        states.append(after(states[-1], *hands.of(opening.PlaceFound)))
        hands.frames(6)
    assert (states[-1].dialog, Path(wanted())) == (asker, Path("/home") / before.name)
    if asker is Dialog.SAVE:
        assert back.scene.pending == states[-1].scene.pending == waiting.scene.pending
    states.append(back)
    assert (back.dialog, Path(wanted())) == (asker, before)


def test_the_kinds_of_export_are_where_they_were_when_the_dialog_opens_again(items: Items) -> None:
    places = set()
    for what in outputs.OFFERED:
        state = after(shown_scene(), export.ShowExport())
        state = after(state, export.EditForm(replace(state.exporting.form, what=what)))
        with context(SIZE):
            frames(lambda seen, state=state: dialogs.draw(state, seen), look(), 6)
            assert box("Export")[3] <= SIZE[1]
        places.add(middle(items, outputs.RGB.label))
    assert len(places) == 1


def test_buttons_of_a_selection_stay_as_it_grows(items: Items, monkeypatch) -> None:
    places = set()
    state = with_info(shown_scene(), num_gaussians=92_440)
    for count in (1, 22, 333, 4_444, 92_440):
        monkeypatch.setattr(Editing, "num_selected", property(lambda editing, count=count: count))
        with context(SIZE):
            frames(lambda seen: tools.draw(state, seen, PLACE, ROOM), look(), 6)
        places.add(middle(items, tools.fa.ICON_FA_TRASH))
    assert len(places) == 1


def test_stages_are_said_in_plain_words() -> None:
    for stage in (*STAGES, *GuidedDepthNet.stages, *PointMapNet.stages):
        assert said(stage) != stage
    assert said("drawing") == "drawing"


@pytest.mark.parametrize(
    ("way", "axis", "sign"), [("left", 0, -1), ("right", 0, 1), ("up", 1, -1), ("down", 1, 1)]
)
def test_keys_lead_around_the_scene(way: str, axis: int, sign: int) -> None:
    state = shown_scene()
    command = named(f"Orbit: {way}").make(state)
    assert command is not None
    turned = apply(state, command).scene.pose
    moved = state.scene.pose.axes.T @ (np.array(turned.centre) - np.array(state.scene.pose.centre))
    assert sign * moved[axis] > 0.01  # the camera's right and down
    assert np.allclose(turned.pivot, state.scene.pose.pivot)


def test_every_window_with_something_to_press_is_an_area(items: Items) -> None:
    """F6 leads there; those without are said here."""
    code = "\n".join(path.read_text() for path in Path(layout.__file__).parents[1].rglob("*.py"))
    names = set(re.findall(r'(?:imgui\.begin|widgets\.window|widgets\.floating|_panel)\(f?"([^"]+)"', code))
    silent = {"##toast{toast.key}", "##splitter", "##status", "##picture", "##legend", "##axes"}
    bars = {f"##bar{number}" for number in range(5)}
    assert names - silent - {"##bar{number}"} | bars == set(keys.AREAS)


@pytest.mark.parametrize("ctrl", [False, True])
def test_arrows_with_ctrl_lead_to_no_other_control(ctrl: bool) -> None:
    state, places = shown_scene(), list[int]()

    def draw(seen: Look) -> list[Command]:
        imgui.button("left of it")
        imgui.same_line()
        imgui.button("first")
        if imgui.is_window_appearing():
            imgui.set_keyboard_focus_here(-1)
        places.append(imgui.get_current_context().nav_id)
        return keys.draw(state)

    hands = Hands(draw, bare=True)
    with context(SIZE):
        imgui.get_io().config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
        hands.frames(4)
        if ctrl:
            imgui.get_io().add_key_event(imgui.Key.mod_ctrl, True)
            imgui.get_io().add_key_event(imgui.Key.left_ctrl, True)
            imgui.get_io().add_key_event(imgui.Key.mod_shift, True)
            hands.frames()
        before = places[-1]
        hands.key(imgui.Key.left_arrow)
    assert (places[-1] == before) == ctrl
    assert bool(hands.of(Orbit)) == ctrl


def test_a_colour_is_chosen_by_the_key_that_began() -> None:
    state, entry = after(shown_scene(), edit.SelectAll()), named("Recolour the selection")
    for tinting in (True, False):
        command = entry.make(state)
        assert command is not None
        state = apply(state, command)
        assert (state.editing.tint is not None) == tinting
    assert state.editing.marks is not None
    assert [type(change).__name__ for change in state.editing.marks.changes] == ["Recoloured"]


def measuring() -> State:
    state = shown_scene()
    spots = ((-0.3, 0.0, 1.0), (0.3, 0.0, 1.0))
    return state.with_editing(tool=Tool.RULER, ruler=spots)


@pytest.mark.parametrize("mark", ["asked", "card", "region", "ruler"])
def test_marks_on_the_picture_are_below_a_dialog(mark: str) -> None:
    """A dot of the place that was asked about shone through the list of scenes to merge."""
    state, before = replace(shown_scene(), dialog=Dialog.HELP), list[int]()
    place, path = (400.0, 300.0), ((400.0, 300.0), (500.0, 420.0))
    marked = {
        "asked": replace(state.editing, asked=place),
        "card": replace(state.editing, card=Card(Reading(place), ())),
        "region": replace(state.editing, tool=Tool.BOX, drag=path),
        "ruler": measuring().editing,
    }
    shown = replace(look(), picture=SimpleNamespace(glo=1))  # pyright: ignore[reportArgumentType]

    def draw(seen: Look) -> list[Command]:
        issued, _ = layout.draw_all(replace(state, editing=marked[mark]), shown)
        before.append(imgui.get_foreground_draw_list().vtx_buffer.size())
        return issued

    with context(SIZE):
        Hands(draw).frames(4)
    assert before[-1] == 0


def test_an_answer_is_over_the_dictionary() -> None:
    """It lay behind it: its words and buttons could not be reached."""
    state = shown_scene()
    wanted = replace(state.preferences, dictionary_open=True, dictionary=(400, 100, 400, 500))
    states = [replace(state, preferences=wanted)]
    shown = replace(look(), picture=SimpleNamespace(glo=1))  # pyright: ignore[reportArgumentType]

    def over(x: float, y: float) -> str:
        imgui.get_io().add_mouse_pos_event(x, y)
        hands.frames()
        window = imgui.get_current_context().hovered_window
        assert window is not None
        return window.name

    card = Card(Reading((200.0, 100.0)), (("chair", 0.9),))  # of the picture's place
    answered = states[0].with_editing(card=card)
    with context(SIZE):
        hands = Hands(lambda seen: layout.draw_all(states[-1], shown)[0])
        for state in (answered, states[0]):  # the window of answers is older than the dictionary's last click
            states.append(state)
            hands.frames(4)
        hands.click(600, 590)
        assert over(600, 590).startswith("Dictionary")
        states.append(answered)
        hands.frames(4)
        left, top, right, bottom = box("##card")
        x, y = (max(left, 400) + right) / 2, (max(top, 100) + bottom) / 2
        assert left < x < 800 and top < y < 600, "they overlap"
        assert over(x, y) == "##card"


@pytest.mark.parametrize("by_key", [False, True])
def test_a_length_is_taken_once_when_its_field_is_left(items: Items, by_key: bool) -> None:
    """Every other time would be an edit of its own, to be undone on its own."""
    states = [measuring()]
    hands = Hands(lambda seen: ruler.draw(states[-1], seen, PLACE, ROOM))

    def leave() -> None:
        if by_key:
            hands.key(imgui.Key.enter)
        else:
            hands.click(1100, 700)  # beside it
        hands.frames(4)

    with context(SIZE):
        hands.frames(4)
        hands.click(*middle(items, "cm"))
        imgui.get_io().add_input_characters_utf8("120")
        hands.frames()
        leave()
        assert hands.of(point.SetLength) == [point.SetLength(1.2)]
        states.append(point.SetLength(1.2).apply(states[0]))
        assert states[-1].metric
        hands.frames(4)
        hands.click(*middle(items, "cm"))
        leave()  # as it was
    assert hands.of(point.SetLength) == [point.SetLength(1.2)]


def test_the_first_length_is_typed_without_a_click() -> None:
    """Digits would be keys of the modes; once there is a scale they are again."""
    hands = Hands(lambda seen: ruler.draw(state, seen, PLACE, ROOM))
    for state in (measuring(), point.SetLength(1.2).apply(measuring())):
        with context(SIZE):
            hands.frames(4)
            assert imgui.get_io().want_text_input == (state.metric is None)
            imgui.get_io().add_input_characters_utf8("60")
            hands.frames()
            hands.key(imgui.Key.enter)
    assert hands.of(point.SetLength) == [point.SetLength(0.6)]


def test_a_dialog_stays_in_the_window() -> None:
    """Also where it was dragged to its edge, or the window became smaller: its buttons were outside."""
    state = replace(shown_scene(), dialog=Dialog.SETTINGS)
    hands = Hands(lambda seen: dialogs.draw(state, seen))
    with context(SIZE):
        hands.frames(4)
        for far in (ImVec2(-300, -200), ImVec2(SIZE[0] - 40, SIZE[1] - 40)):
            imgui.set_window_pos(Dialog.SETTINGS.value, far)
            hands.frames(3)
            left, top, right, bottom = box(Dialog.SETTINGS.value)
            assert left >= 0 and top >= 0 and right <= SIZE[0] and bottom <= SIZE[1]


def test_an_export_that_begins_moves_nothing_in_the_panel_and_takes_no_keys(
    items: Items, monkeypatch
) -> None:
    """Enter would stop it."""
    state = shown_scene()
    running = state.with_exporting(running=Running(Path("mask.png")))
    monkeypatch.setattr(layout.canvas, "draw", lambda state, look: [])  # needs OpenGL
    places = []
    with context(SIZE):
        imgui.get_io().config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
        for each in (state, running):
            hands = Hands(lambda seen, each=each: layout.draw_all(each, seen)[0])
            hands.frames(6)
            places.append(middle(items, "##text"))
        assert any(name.endswith("Stop the export") for name in items.now())
        window = imgui.get_current_context().nav_window
        assert window is None or window.name != "##export"
    assert places[0] == places[1]


def test_a_film_begins_with_a_button(items: Items) -> None:
    state = shown_scene()
    hands = Hands(lambda seen: views.draw(state, seen), bare=True)
    with context(SIZE):
        hands.frames(4)
        hands.click(*middle(items, views.fa.ICON_FA_VIDEO))
    assert hands.of(film.AddKey) == [film.AddKey()]


@pytest.mark.parametrize(("height", "first"), [(800, "known"), (600, "scores")])
def test_chips_keep_their_place_where_there_is_room(height: int, first: str, monkeypatch) -> None:
    drawn = []
    monkeypatch.setattr(known, "draw", lambda state, look: drawn.append("known") or [])
    monkeypatch.setattr(scores, "draw", lambda state, look: drawn.append("scores") or [])
    state = shown_scene()
    assert state.asking.asked
    with context((1280, height)):
        Hands(lambda seen: prompts.draw(state, seen), bare=True).frames(1)
    assert drawn[0] == first


def test_what_needs_nothing_loaded_is_not_kept_waiting(tmp_path: Path) -> None:
    """The samples' pictures and the first folder come before torch."""
    worker = Worker(begins=False)
    worker.submit(SampleTiles())
    worker.submit(ReadFolder(tmp_path))
    worker.begin()
    came: list[Command] = []
    end = time.monotonic() + PATIENCE
    while not any(isinstance(each, Loaded) for each in came):
        assert time.monotonic() < end, came
        came += worker.poll()
        time.sleep(0.01)
    worker.stop()
    kinds = [type(each).__name__ for each in came]
    assert kinds[:5] == ["ShowPicture"] * 5 and kinds[5] == "FolderRead"
