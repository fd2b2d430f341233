"""Every dialog by the keyboard: Enter presses its orange button, Esc leaves it."""

from dataclasses import replace
from pathlib import Path

import pytest
from imgui_bundle import imgui

from app.window import commands as do
from app.window.asking import commands as ask
from app.window.commands import Command
from app.window.dialogs import Dialog
from app.window.editing import cleaning as clean
from app.window.exporting import commands as export
from app.window.exporting.state import Running
from app.window.frame import dialogs, keys
from app.window.kit import theme
from app.window.kit.look import Look
from app.window.opening import commands as opening
from app.window.opening.state import Film, Folder
from app.window.scene import commands as show
from app.window.scene import merging
from app.window.scene.drops import There, Typed
from app.window.scene.state import Job
from app.window.state import State
from langflash_core.images.strip import Still, Strip
from tests.app.window.headless import context, frames, look
from tests.app.window.scenes import after
from tests.app.window.test_small_windows import edited
from tests.app.window.test_stumbles import Hands

SIZE = (900, 560)
FILE = Path("/rooms/room.langflash")
STILLS = tuple(Still(f"{number}.jpg", 0.5 * number, 40.0, float(number), 12) for number in range(9))
FILM = Film(
    Path("/films/walk.mp4"),
    Strip("walk.mp4", Path("/films"), 4.5, STILLS),
    (0, 4, 8),
    left=(("between", 90),),
    proposed=(0, 4, 8),
    reasons=("between",) * len(STILLS),
)


def opened(dialog: Dialog) -> State:
    """A dialog with what it is about: a path, a folder, a film, a file that is there."""
    state = edited().with_scene(dropped=(FILE,), pending=(do.Leave(sure=True),))
    state = state.with_opening(folder=Folder(FILE.parent, (FILE.parent / "old",)), film=FILM)
    typed = "" if dialog is Dialog.PLACE else str(FILE)  # Enter walks into a folder that is typed there
    state = replace(state, dialog=dialog, typed=Typed(typed, There.NOTHING))
    if dialog is Dialog.EXPORT:
        state = after(state, export.ShowExport(), export.CopiesAt(FILE.with_name("edited.langflash"), None))
    return state.with_exporting(there=(FILE,)) if dialog is Dialog.REPLACE else state


ORANGE: dict[Dialog, type[Command]] = {
    Dialog.SAVE: show.SaveScene,
    Dialog.OPEN: show.OpenPaths,
    Dialog.LEAVE: show.SaveFirst,
    Dialog.DROP: show.Instead,
    Dialog.DROP_SCENE: show.Instead,
    Dialog.MERGE: merging.MergeScene,
    Dialog.PLACE: opening.PlaceFound,
    Dialog.FILM: opening.TakeFrames,
    Dialog.UNSAVED: show.SaveFirst,
    Dialog.SAVE_PROMPTS: ask.SavePrompts,
    Dialog.LOAD_PROMPTS: ask.LoadPrompts,
    Dialog.SAVE_RECIPE: clean.SaveRecipe,
    Dialog.LOAD_RECIPE: clean.LoadRecipe,
    Dialog.EXPORT: export.Export,
    Dialog.REPLACE: export.Export,
}
READ = (Dialog.HELP, Dialog.SETTINGS, Dialog.LOG, Dialog.PALETTE)  # without an orange button at the foot


def pressed(state: State, *pushed: imgui.Key) -> list[Command]:
    """What a dialog gives when these keys go down and up, one after another."""

    def panel(seen: Look) -> list[Command]:
        return dialogs.draw(state, seen) + keys.draw(state)

    with context(SIZE):
        imgui.get_io().config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
        theme.set_up(1.0, "dark")
        hands = Hands(panel)
        hands.frames(6)
        for key in pushed:
            hands.key(key)
        return hands.issued


def test_each_dialog_has_an_orange_button_or_is_read() -> None:
    assert {*ORANGE, *READ} == set(Dialog)


@pytest.mark.parametrize("key", [imgui.Key.enter, imgui.Key.keypad_enter], ids=["enter", "keypad"])
@pytest.mark.parametrize("dialog", ORANGE, ids=lambda dialog: dialog.name)
def test_enter_presses_the_orange_button(dialog: Dialog, key: imgui.Key) -> None:
    """Once: in most dialogs it pressed nothing, or what happened to come first."""
    issued = [command for command in pressed(opened(dialog), key) if isinstance(command, ORANGE[dialog])]
    assert len(issued) == 1


@pytest.mark.parametrize("dialog", list(Dialog), ids=lambda dialog: dialog.name)
def test_escape_leaves_every_dialog(dialog: Dialog) -> None:
    left = opening.PlaceFound(None) if dialog is Dialog.PLACE else do.ShowDialog(None)
    assert left in pressed(opened(dialog), imgui.Key.escape)


def test_escape_in_a_menu_shuts_the_menu_and_leaves_the_job_alone() -> None:
    """ImGui shuts it before the keys are read, and a reconstruction of minutes was cancelled too."""
    state = edited().with_scene(job=Job("Reconstructing", "reading photos", 0.3))

    def panel(seen: Look) -> list[Command]:
        imgui.begin("panel")
        if imgui.is_key_pressed(imgui.Key.f9):
            imgui.open_popup("menu")
        if imgui.begin_popup("menu"):
            imgui.text("Open ...")
            imgui.end_popup()
        imgui.end()
        return keys.draw(state)

    with context(SIZE):
        imgui.get_io().config_flags |= imgui.ConfigFlags_.nav_enable_keyboard
        hands = Hands(panel)
        hands.key(imgui.Key.f9)
        assert imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
        hands.key(imgui.Key.escape)
        assert not imgui.is_popup_open("", imgui.PopupFlags_.any_popup) and hands.issued == []
        hands.key(imgui.Key.escape)
        assert hands.issued == [show.CancelJob()]


def test_enter_presses_the_control_that_tab_has_led_to() -> None:
    issued = pressed(opened(Dialog.LEAVE), imgui.Key.tab, imgui.Key.tab, imgui.Key.enter)
    assert do.Leave(sure=True) in issued and show.SaveFirst() not in issued


def test_enter_waits_for_an_export_and_tab_leads_to_quitting_without_it() -> None:
    """Of a saved scene, of which there is nothing to save."""
    state = opened(Dialog.LEAVE)
    assert state.scene.info is not None
    saved = state.with_scene(info=replace(state.scene.info, path=FILE)).with_editing(
        saved=state.editing.marks
    )
    busy = saved.with_exporting(running=Running(Path("walk.mp4")))
    issued = pressed(busy, imgui.Key.enter)
    assert do.ShowDialog(None) in issued and do.Leave(sure=True) not in issued
    assert do.Leave(sure=True) in pressed(busy, imgui.Key.tab, imgui.Key.tab, imgui.Key.enter)


def test_enter_does_not_press_a_button_that_is_disabled() -> None:
    state = replace(opened(Dialog.LOAD_PROMPTS), typed=Typed(""))
    assert not any(isinstance(command, ask.LoadPrompts) for command in pressed(state, imgui.Key.enter))


@pytest.mark.parametrize("size", [SIZE, (1280, 800)], ids=str)
@pytest.mark.parametrize("dialog", Dialog)
def test_a_dialog_comes_with_the_size_that_it_keeps(dialog: Dialog, size: tuple[int, int]) -> None:
    """That of exports was a strip for one frame."""
    state, shown = opened(dialog), []
    with context(size):
        theme.set_up(1.0, "dark")
        for _ in range(8):
            frames(lambda seen: dialogs.draw(state, seen), look(), 1)
            window = imgui.internal.find_window_by_name(dialog.value)
            if window is not None and not window.hidden:
                shown.append((window.pos.x, window.pos.y, window.size.x, window.size.y))
    assert len(shown) >= 4 and len(set(shown)) == 1
