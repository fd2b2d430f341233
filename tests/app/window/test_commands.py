"""Commands that every part of the window shares, as pure changes of a frozen state; and small words."""

from dataclasses import replace
from pathlib import Path

import pytest

from app.window import commands as do
from app.window.asking import commands as ask
from app.window.dialogs import Dialog
from app.window.editing import commands as edit
from app.window.exporting.state import Running
from app.window.frame.status import figures, fitting
from app.window.kit.widgets import sentence
from app.window.scene import camera
from app.window.scene import commands as show
from app.window.state import TOAST_SECONDS, State
from langflash_core.base import pictures
from tests.app.window.scenes import after, shown_scene
from tests.app.window.test_small_windows import edited


def test_a_command_leaves_the_old_state_alone() -> None:
    before = State()
    after(before, ask.EditPrompt(0, "door"), camera.SetMode(pictures.DEPTH), do.Notify("x"))
    assert before == State()


def test_toasts_are_shown_once_expire_and_close() -> None:
    state = after(State(now=3.0), do.Notify("a"), do.Notify("b", "info"), do.Notify("a"))
    assert [t.text for t in state.toasts] == ["b", "a"]
    assert [t.text for t in after(state, do.Tick(3.0 + TOAST_SECONDS["info"])).toasts] == ["a"]
    assert after(state, do.DismissToast(state.toasts[1].key)).toasts == state.toasts[:1]


def test_leaving_asks_while_a_scene_is_unsaved(shown: State) -> None:
    assert after(State(), do.Leave()).leaving
    asked = after(shown, do.Leave())
    assert not asked.leaving and asked.dialog is Dialog.LEAVE
    assert after(asked, do.Leave(sure=True)).leaving
    assert after(shown, show.SceneSaved(Path("s.langflash")), do.Leave()).leaving


def test_leaving_asks_while_edits_of_a_saved_scene_are_unsaved() -> None:
    """It closed at once; the edits were kept beside, but nobody was told so."""
    opened = edited()
    assert opened.scene.info is not None
    opened = opened.with_scene(info=replace(opened.scene.info, path=Path("s.langflash")))
    saved = after(opened, show.SceneSaved(Path("s.langflash"), opened.editing.marks))
    assert after(saved, do.Leave()).leaving
    asked = after(saved, edit.Delete(), do.Leave())
    assert not asked.leaving and asked.dialog is Dialog.LEAVE
    assert asked.scene.pending == (do.Leave(sure=True),)


def test_leaving_asks_while_an_export_is_under_way(shown: State) -> None:
    """A film was dropped without a word."""
    saved = after(shown, show.SceneSaved(Path("s.langflash")))
    busy = saved.with_exporting(running=Running(Path("walk.mp4")))
    asked = after(busy, do.Leave())
    assert not asked.leaving and asked.dialog is Dialog.LEAVE
    assert after(asked, do.Leave(sure=True)).leaving


def test_the_save_dialog_proposes_a_place(shown: State) -> None:
    state = after(shown, show.AddPhotos((Path("/p/left.jpg"),)), do.ShowDialog(Dialog.SAVE))
    assert state.typed.text == str(Path("/p/left.langflash"))
    saved = after(state, show.SceneSaved(Path("/q/s.langflash")), do.ShowDialog(Dialog.SAVE))
    assert saved.typed.text == str(Path("/q/s.langflash"))
    assert "no scene to save" in after(State(), show.SaveScene(Path("s"))).toasts[0].text


def test_the_status_bar_shows_what_fits() -> None:
    assert [fitting([30, 20, 10], 5, room) for room in (0, 30, 55, 69, 70)] == [0, 1, 2, 2, 3]


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


def test_a_finer_picture_on_its_way_is_told_in_the_status_bar() -> None:
    state = shown_scene()
    assert not any("refining" in text for text in figures(state))
    drawing = replace(state, stats=replace(state.stats, settling=True))
    assert "refining ..." in figures(drawing)
    counted = replace(state, stats=replace(state.stats, passes=(("blend", 5),)))
    assert figures(counted) == figures(state), "counts of passes tell nobody anything"
    large, small = (
        replace(state, stats=replace(state.stats, memory=size)) for size in (1_540_000_000, 10**8)
    )
    assert "up to 1.5 GB of memory so far" in figures(large) and figures(small) == figures(state)
    failed = replace(state, stats=replace(state.stats, failing=True))
    assert any("refining failed" in text for text in figures(failed))
