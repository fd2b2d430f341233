"""A path that is typed in a dialog: what is listed of it, and what the buttons do."""

from dataclasses import replace
from pathlib import Path

import pytest

from app.window import commands as do
from app.window.commands import Command
from app.window.dialogs import PROMPTS, RECIPES, Dialog
from app.window.frame import dialogs
from app.window.opening import commands as opening
from app.window.opening.panels import browser
from app.window.opening.state import Folder
from app.window.scene import commands as show
from app.window.scene.drops import There, Typed
from app.window.state import State
from tests.app.window.headless import context
from tests.app.window.items import Items
from tests.app.window.test_dialogs import SIZE, opened
from tests.app.window.test_stumbles import Hands, items, middle

__all__ = ["items"]  # a fixture

ROOT = Path("/photos")
SHOWN = Folder(ROOT, (ROOT / "kitchen", ROOT / "hall"), (ROOT / "k1.jpg", ROOT / "k2.jpg"))


def typing(text: str, there: There = There.NOTHING, shown: Folder = SHOWN) -> State:
    return replace(State().with_opening(folder=shown), dialog=Dialog.OPEN, typed=Typed(text, there))


def drawn(state: State, items: Items) -> set[str]:
    """The labels of what is listed."""
    with context(SIZE):
        Hands(lambda seen: browser.draw(state, seen), bare=True).frames(4)
    return set(items.now())


def clicked(state: State, items: Items, label: str) -> list[Command]:
    with context(SIZE):
        hands = Hands(lambda seen: dialogs.draw(state, seen))
        hands.frames(6)
        hands.click(*middle(items, label))
        return hands.issued


def listed(state: State, items: Items) -> list[str]:
    found = (*SHOWN.folders, *SHOWN.photos)
    return [path.name for path in found if any(label.endswith(f"##{path}") for label in drawn(state, items))]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("", ["kitchen", "hall", "k1.jpg", "k2.jpg"]),
        ("/photos", ["kitchen", "hall", "k1.jpg", "k2.jpg"]),
        ("/photos/K", ["kitchen", "k1.jpg", "k2.jpg"]),
        ("k2", ["k2.jpg"]),
        ("/photos/x", []),
    ],
)
def test_the_list_holds_what_begins_as_what_is_typed(items: Items, text: str, names: list[str]) -> None:
    there = There.FOLDER if text == "/photos" else There.NOTHING
    assert listed(typing(text, there), items) == names


@pytest.mark.parametrize(
    ("text", "there", "shown", "label", "command"),
    [
        ("/photos", There.FOLDER, SHOWN, "Open 2 photos###open", show.OpenPaths(("/photos",))),
        ("/photos/", There.FOLDER, SHOWN, "Look inside###open", opening.LookInto(ROOT)),
        ("kitchen", There.FOLDER, SHOWN, "Look inside###open", opening.LookInto(ROOT / "kitchen")),
        ("/photos", There.FOLDER, Folder(ROOT), "Look inside###open", opening.LookInto(ROOT)),
        ("k2.jpg", There.FILE, SHOWN, "Open###open", show.OpenPaths(("/photos/k2.jpg",))),
    ],
)
def test_the_button_says_what_becomes_of_what_is_typed(
    items: Items, text: str, there: There, shown: Folder, label: str, command: Command
) -> None:
    """A folder of films and scenes opened the first film."""
    assert command in clicked(typing(text, there, shown), items, label)


@pytest.mark.parametrize("dialog", [Dialog.SAVE, *PROMPTS, *RECIPES], ids=lambda dialog: dialog.name)
def test_a_dialog_for_a_file_has_a_button_to_cancel(items: Items, dialog: Dialog) -> None:
    """Who does not know of Esc had none."""
    assert do.ShowDialog(None) in clicked(opened(dialog), items, "Cancel")
