"""Preferences last, and a bad file never stops the start."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from app.window.commands import Command
from app.window.recovery import panels, preferences
from app.window.recovery.commands import Prefer
from app.window.recovery.preferences import DEFAULTS, MOST_RECENT, Preferences
from app.window.state import State
from tests.app.window.headless import context, frames, look


def test_they_come_back_as_they_were_left(folders: Path) -> None:
    left = Preferences(
        theme="light", scale=1.5, speed=2.0, touch_pad=True, panel_width=420.0,
        window=(-30, 40, 1000, 700), maximised=True, dictionary=(400, 60, 372, 430),
        dictionary_open=True, detail="high", recent=("/a b/ä.langflash",),
    )  # fmt: skip
    preferences.save(left)
    assert preferences.load() == (left, "")
    assert preferences.file().parent == folders / "config"


def test_without_a_file_there_are_defaults_and_silence(folders: Path) -> None:
    assert preferences.load() == (DEFAULTS, "")


@pytest.mark.parametrize("content", [b"", b"{cut short", b"\xff\xfe\x00", b"[1]", b"[" * 100_000])
def test_a_damaged_file_gives_defaults_and_a_sentence(folders: Path, content: bytes) -> None:
    preferences.save(DEFAULTS)
    preferences.file().write_bytes(content)
    loaded, sentence = preferences.load()
    assert loaded == DEFAULTS
    assert "defaults" in sentence and str(preferences.file()) in sentence


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("theme", "pink"), ("scale", 9), ("scale", "1"), ("scale", True), ("speed", -1), ("touch_pad", 1),
        ("window", [1, 2, 3]), ("window", [0, 0, 10, 10]), ("window", [1e9, 0, 900, 600]),
        ("dictionary", [0, 0, 300]), ("dictionary_open", 1), ("recent", [1]), ("recent", "room"),
        ("panel_width", None), ("detail", "highest"), ("detail", 2), ("detail", ["low"]),
    ],
)  # fmt: skip
def test_one_bad_value_costs_only_itself(folders: Path, name: str, value: object) -> None:
    preferences.save(replace(DEFAULTS, maximised=True))
    content = {**json.loads(preferences.file().read_bytes()), name: value, "from a later version": 1}
    preferences.file().write_text(json.dumps(content))
    loaded, sentence = preferences.load()
    assert loaded == replace(DEFAULTS, maximised=True)
    assert name in sentence


def test_a_file_from_before_there_was_a_detail_opens_as_it_was(folders: Path) -> None:
    preferences.save(replace(DEFAULTS, theme="light"))
    content = json.loads(preferences.file().read_bytes())
    assert content.pop("detail") == "normal"
    preferences.file().write_text(json.dumps(content))
    assert preferences.load() == (replace(DEFAULTS, theme="light"), "")


def test_a_detail_is_chosen_in_the_panel(monkeypatch: pytest.MonkeyPatch) -> None:
    def chosen(options, old):
        return "high" if ("High", "high") in options else old

    monkeypatch.setattr(panels.widgets, "choice", chosen)
    found: list[Command] = []
    with context((800, 600)):
        frames(lambda seen: found.extend(panels.draw_settings(State(), seen)), look(), 1)
    assert found == [Prefer(replace(DEFAULTS, detail="high"))]


def test_recent_files_are_few_and_newest_first() -> None:
    remembered = DEFAULTS
    for index in range(MOST_RECENT + 3):
        remembered = remembered.opened(Path(f"{index}"))
    remembered = remembered.opened(Path("5"))
    assert remembered.recent[:2] == ("5", str(MOST_RECENT + 2))
    assert len(remembered.recent) == len(set(remembered.recent)) == MOST_RECENT


def test_a_folder_that_cannot_be_written_is_a_sentence(folders: Path) -> None:
    (folders / "config").write_text("a file in the way")
    assert "not kept" in preferences.try_to_save(DEFAULTS)
