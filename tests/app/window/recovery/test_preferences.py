"""Preferences last, and a bad file never stops the start."""

import json
from dataclasses import fields, replace
from pathlib import Path

import pytest

from app.window.asking.commands import OpenDictionary
from app.window.commands import Command
from app.window.frame import table
from app.window.recovery import locks, panels, preferences
from app.window.recovery.commands import Prefer
from app.window.recovery.preferences import DEFAULTS, MOST_RECENT, PANEL_WIDTHS, Preferences
from app.window.state import State
from tests.app.window.headless import context, frames, look
from tests.app.window.scene.test_standing import STANDS
from tests.app.window.scenes import shown_scene
from tests.torture.failing import failing


def test_they_come_back_as_they_were_left(folders: Path) -> None:
    left = Preferences(
        theme="light", scale=1.5, speed=2.0, touch_pad=True, panel_width=420.0,
        window=(-30, 40, 1000, 700), maximised=True, dictionary=(400, 60, 372, 430),
        dictionary_open=True, detail="high", rasteriser="tiles", recent=("/a b/ä.langflash",),
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
        ("rasteriser", "triangles"), ("rasteriser", ["tiles"]),
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


def test_what_is_set_by_name_is_a_preference(monkeypatch: pytest.MonkeyPatch) -> None:
    """Types do not see it."""
    other = lambda options, old: next(value for _, value in options if value != old)  # noqa: E731
    monkeypatch.setattr(panels.widgets, "choice", other)
    monkeypatch.setattr(panels.widgets, "worded_checkbox", lambda _, on: (True, not on))
    issued: list[Command] = []
    with context((800, 600)):
        frames(lambda seen: issued.extend(panels.draw_settings(State(), seen)), look(), 1)
    looks = {"theme", "colormap", "detail", "rasteriser", "scale"}
    switches = {"photos_in_space", "near_photos", "fill_gaps", "floor_grid"}
    assert changed(issued[0], DEFAULTS) == looks | switches | {"touch_pad", "start_at_once"}
    state = shown_scene()
    assert state.editing.history is not None
    marks = replace(state.editing.history.marks, world=STANDS)
    state = state.with_editing(history=state.editing.history.edited("Level", marks))
    made = [entry.make(state) for entry in table.ENTRIES]
    told = [changed(command, state.preferences) for command in made if isinstance(command, Prefer)]
    assert set[str]().union(*told) == switches


def changed(command: Command, before: Preferences) -> set[str]:
    assert isinstance(command, Prefer)
    after = command.preferences
    return {each.name for each in fields(before) if getattr(after, each.name) != getattr(before, each.name)}


def test_recent_files_are_few_and_newest_first() -> None:
    remembered = DEFAULTS
    for index in range(MOST_RECENT + 3):
        remembered = remembered.opened(Path(f"{index}"))
    remembered = remembered.opened(Path("5"))
    assert remembered.recent[:2] == ("5", str(MOST_RECENT + 2))
    assert len(remembered.recent) == len(set(remembered.recent)) == MOST_RECENT


def test_of_two_windows_each_keeps_what_it_changed(folders: Path) -> None:
    """The second one did not know of what the first had changed since both began."""
    began = replace(DEFAULTS, recent=("/old",), scale=1.5)
    preferences.save(began)
    one = replace(began, theme="light", speed=2.0, recent=("/one", "/old"))
    other = replace(began, scale=1.0, speed=3.0, recent=("/other", "/old"))
    assert not preferences.try_to_save(one, began) and not preferences.try_to_save(other, began)
    both = replace(DEFAULTS, theme="light", scale=1.0, speed=3.0, recent=("/other", "/one", "/old"))
    assert preferences.load() == (both, "")
    # Neither shows what the other did, and neither takes it back.
    assert not preferences.try_to_save(replace(one, fill_gaps=False), one)
    assert preferences.load() == (replace(both, fill_gaps=False), "")


@pytest.mark.parametrize(
    ("own", "since", "theirs", "together"),
    [
        ("ab", "ab", "cab", "cab"), ("ba", "ab", "cab", "bca"), ("", "ab", "cab", ""),
        ("x", "ab", "cab", "xc"), ("ab", "ab", "", ""), ("cab", "ab", "", "c"),
        ("kabcdefghi", "abcdefghij", "zabcdefghi", "kzabcdefgh"),
    ],
)  # fmt: skip
def test_recent_files_of_two_windows(own: str, since: str, theirs: str, together: str) -> None:
    lists = (Preferences(recent=tuple(each)) for each in (own, since, theirs))
    assert preferences.merged(*lists).recent == tuple(together)


def test_what_cannot_be_merged_is_written_or_said(folders: Path) -> None:
    """Damaged, it holds nothing to lose; where it cannot be read, another's settings may be in it."""
    preferences.save(DEFAULTS)
    own = replace(DEFAULTS, theme="light", scale=1.25)
    for content in (b"{cut short", b"[1]"):
        preferences.file().write_bytes(content)
        preferences.save(own, since=own)
        assert preferences.load() == (own, "")
    with failing("read", 1, folders):
        assert "other windows" in preferences.try_to_save(replace(own, theme="dark"), own)
    assert preferences.load() == (own, "")
    preferences.file().unlink()
    preferences.save(own, since=own)
    assert preferences.load() == (own, "")


def test_a_window_that_never_ends_writing_is_waited_for_and_said(folders: Path, monkeypatch) -> None:
    monkeypatch.setattr(locks, "_PATIENCE", 0.05)
    preferences.save(DEFAULTS)
    with locks.one_at_a_time(preferences.file().with_suffix(".lock")):
        said = preferences.try_to_save(replace(DEFAULTS, theme="light"), DEFAULTS)
    assert "could not be saved" in said and preferences.load() == (DEFAULTS, "")


def test_a_folder_that_cannot_be_written_is_a_sentence(folders: Path) -> None:
    (folders / "config").write_text("a file in the way")
    assert "could not be saved" in preferences.try_to_save(DEFAULTS)


def test_the_layout_is_kept_within_its_limits() -> None:
    wanted = replace(State().preferences, panel_width=9999.0, dictionary=(1, 2, 380, 300))
    state = OpenDictionary(True).apply(Prefer(wanted).apply(State()))
    kept = state.preferences
    assert (kept.panel_width, kept.dictionary, kept.dictionary_open) == (
        PANEL_WIDTHS[1],
        (1, 2, 380, 300),
        True,
    )
