"""Prompt sets as files, good and damaged."""

import json
from pathlib import Path

import pytest

from app.window import commands as do
from app.window.asking import commands as ask
from app.window.asking.prompt_sets import PromptSet, read_prompts, write_prompts
from app.window.asking.state import PALETTE, Prompt
from app.window.dialogs import Dialog
from app.window.state import State
from langflash_core.base import pictures
from langflash_core.errors import OutputError, PromptError
from tests.app.window.scenes import after


def a_set() -> PromptSet:
    first = Prompt(4, "été à la mer", PALETTE[3], 0.625, visible=False)
    return PromptSet((first, Prompt(9), Prompt(7, "chair - armchair", PALETTE[1])), ("stuff", "things"))


def test_a_prompt_set_comes_back_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "my set.prompts.json"
    write_prompts(a_set(), path)
    found = read_prompts(path)
    assert found.negatives == ("stuff", "things")
    one, two = found.prompts  # empty rows are not kept
    assert (one.text, one.colour, one.threshold, one.visible) == ("été à la mer", PALETTE[3], 0.625, False)
    assert (two.text, two.threshold, two.visible) == ("chair - armchair", None, True)
    state = after(State(), ask.Calibrated(0.7), ask.PromptsRead(path, found))
    assert [p.text for p in state.asking.prompts] == [p.text for p in found.prompts]
    assert len({p.key for p in state.asking.prompts}) == 2 and state.next_key > max(
        p.key for p in state.asking.prompts
    )
    assert (state.asking.active, state.scene.mode) == (state.asking.prompts[0].key, pictures.LABELS)
    assert [p.cut for p in state.asking.prompts] == [0.625, 0.7]
    assert state.asking.prompts_path == path and state.asking.negatives == ("stuff", "things")


GOOD = {"format": "langflash prompts", "version": 1, "prompts": [{"text": "door"}], "negatives": []}


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\xff\xfe",
        b"[1, 2",
        b"[]",
        b"[" * 100_000,
        json.dumps({**GOOD, "format": "recipes"}).encode(),
        json.dumps({**GOOD, "version": 2}).encode(),
        json.dumps({**GOOD, "prompts": []}).encode(),
        json.dumps({**GOOD, "prompts": [{"text": "x"}] * 9}).encode(),
        json.dumps({**GOOD, "prompts": [{"text": "   "}]}).encode(),
        json.dumps({**GOOD, "prompts": [{"text": "x" * 501}]}).encode(),
        json.dumps({**GOOD, "prompts": [{"text": 3}]}).encode(),
        json.dumps({**GOOD, "prompts": [{"text": "x", "threshold": float("nan")}]}).encode(),
        json.dumps({**GOOD, "prompts": [{"text": "x", "threshold": 2}]}).encode(),
        json.dumps({**GOOD, "prompts": [{"text": "x", "colour": [0, 1]}]}).encode(),
        json.dumps({**GOOD, "prompts": [{"text": "x", "colour": "red"}]}).encode(),
        json.dumps({**GOOD, "negatives": [None]}).encode(),
        b" " * ((1 << 20) + 1),
    ],
)
def test_a_damaged_set_is_one_sentence(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.prompts.json"
    path.write_bytes(content)
    with pytest.raises(PromptError) as caught:
        read_prompts(path)
    sentence = str(caught.value)
    assert "bad.prompts.json" in sentence and "\n" not in sentence and len(sentence) < 300


def test_the_smallest_set_written_by_hand_is_read(tmp_path: Path) -> None:
    path = tmp_path / "hand.json"
    path.write_text(json.dumps(GOOD))
    found = read_prompts(path)
    assert found.prompts[0] == Prompt(0, "door", PALETTE[0])
    state = after(State(), ask.PromptsRead(path, found))
    assert state.asking.negatives == State().asking.negatives  # none in the file: the usual ones stay


def test_a_set_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        write_prompts(a_set(), tmp_path / "missing" / "x.json")
    assert list(tmp_path.iterdir()) == []


def test_the_dialogs_propose_a_place_and_close(tmp_path: Path) -> None:
    state = after(State(), do.ShowDialog(Dialog.SAVE_PROMPTS))
    assert state.dialog is Dialog.SAVE_PROMPTS and state.typed.text.endswith(".prompts.json")
    state = after(state, ask.SavePrompts(tmp_path / "a.json"), do.ShowDialog(Dialog.LOAD_PROMPTS))
    assert state.typed.text == str(tmp_path / "a.json")
    assert after(state, ask.LoadPrompts(tmp_path / "a.json")).dialog is None


def test_a_phrase_that_asks_for_a_place_is_saved_with_it(tmp_path: Path) -> None:
    """Its words, "like this (door)", mean nothing by themselves."""
    path = tmp_path / "a.prompts.json"
    like = bytes(range(16))
    write_prompts(PromptSet((Prompt(0, "like this (door)", like=like),), ()), path)
    assert read_prompts(path).prompts[0].like == like
    broken = json.loads(path.read_text())
    broken["prompts"][0]["like"] = "zz"
    path.write_text(json.dumps(broken))
    with pytest.raises(PromptError, match="no usable prompt set"):
        read_prompts(path)
