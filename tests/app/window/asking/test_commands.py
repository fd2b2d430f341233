"""Asking without a window: phrases, their answers, the dictionary."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from app.window.asking import commands as ask
from app.window.asking.prompt_sets import MOST_PROMPTS
from app.window.asking.state import BINS, MOST_RECENT, Histogram, unfinished, usable
from app.window.scene import camera
from app.window.scene import commands as show
from app.window.scene.state import possible
from app.window.state import State
from langflash_core.base import pictures
from langflash_core.base.pictures import PICTURES, margin_span
from langflash_core.errors import PromptError
from langflash_core.language.algebra import terms
from langflash_core.language.grammar import read_phrase
from tests.app.window.scenes import after, shown_scene


def asked(*texts: str) -> State:
    state = after(State(), ask.EditPrompt(0, texts[0]))
    for text in texts[1:]:
        state = after(state, ask.AddPrompt())
        state = after(state, ask.EditPrompt(state.asking.active, text))
    return state


def test_recent_phrases_are_kept_once_newest_first_and_bounded() -> None:
    state = after(State(), ask.Remember("door"), ask.Remember(" red  door "), ask.Remember("door"))
    assert state.asking.recent == ("door", "red door")
    state = after(state, ask.Remember("   "), *(ask.Remember(str(n)) for n in range(MOST_RECENT + 5)))
    assert len(state.asking.recent) == MOST_RECENT and state.asking.recent[0] == str(MOST_RECENT + 4)


def test_a_recent_phrase_takes_an_empty_row_or_a_new_one() -> None:
    state = after(State(), ask.Calibrated(0.7), ask.AskAgain("sofa"))
    assert [p.text for p in state.asking.prompts] == ["sofa"] and state.scene.mode is pictures.HEAT
    state = after(state, camera.SetMode(pictures.DEPTH), ask.AskAgain("rug"))
    assert [p.text for p in state.asking.prompts] == ["sofa", "rug"]
    assert state.asking.active == state.asking.prompts[1].key and state.scene.mode is pictures.DEPTH
    assert (
        state.asking.prompts[1].colour != state.asking.prompts[0].colour
        and state.asking.prompts[1].cut == 0.7
    )
    assert state.asking.recent == ("rug", "sofa")
    full = asked(*(str(n) for n in range(MOST_PROMPTS)))
    assert after(full, ask.AskAgain("one more")) == full


@pytest.mark.parametrize("text", ["chair -", "+ chair", "chair - ", "- ", "-", " sofa +  "])
def test_an_unfinished_sum_is_not_asked(text: str) -> None:
    assert unfinished(text) and not usable(text)
    assert asked(text).asking.asked == ()
    with pytest.raises(PromptError):  # the library refuses what the window holds back
        terms(text)


@pytest.mark.parametrize("text", ["chair - armchair", "t-shirt", "C++ book", "sofa + cushion", "-5"])
def test_a_whole_phrase_is_asked(text: str) -> None:
    assert usable(text) and len(asked(text).asking.asked) == 1
    assert terms(text)


def test_what_each_mode_needs() -> None:
    for mode in PICTURES:
        silent, spoken = (state.with_scene(mode=mode) for state in (State(), asked("door")))
        assert silent.wants_maps == mode.maps
        assert spoken.wants_maps  # to be answered
        answered = spoken.with_asking(prompts=tuple(replace(p, score=0.9) for p in spoken.asking.prompts))
        assert answered.wants_maps == (mode.maps or mode.answers)
    assert not any(mode.maps and mode.answers for mode in PICTURES)


def test_modes_that_the_scene_cannot_show(info) -> None:
    assert not any(possible(mode, None) for mode in PICTURES)
    assert not info.own_views and {m for m in PICTURES if not possible(m, info)} == {pictures.AGREEMENT}
    assert possible(pictures.AGREEMENT, replace(info, own_views=True))
    bare = replace(info, views=(), num_atoms=0)
    assert {m for m in PICTURES if not possible(m, bare)} == {
        pictures.AGREEMENT, pictures.COVERAGE, pictures.WEIGHT, pictures.FEATURES,
    }  # fmt: skip


def test_a_histogram_belongs_to_the_text_it_was_made_for() -> None:
    state = asked("door")
    made = Histogram(0, "door", (1,) * BINS)
    state = after(state, ask.Binned((made,)))
    assert state.asking.histogram(0, " door ") == made
    assert state.asking.histogram(0, "doors") is None and state.asking.histogram(1, "door") is None


def test_another_scene_forgets_the_old_ones_atoms_but_no_phrases(info) -> None:
    state = after(State(), show.SceneArrived(info), ask.ShowAtom(2), ask.ChooseAtom(1, True))
    state = after(state, ask.Remember("door"), ask.Binned((Histogram(0, "door", (0,) * BINS),)))
    state = after(state, show.SceneArrived(replace(info, serial=2)))
    assert (state.asking.atom, state.asking.chosen, state.asking.histograms) == (0, (), ())
    assert state.asking.recent == ("door",)


def test_atoms_are_shown_and_chosen(info) -> None:
    state = after(State(), show.SceneArrived(info))
    assert after(state, ask.ShowAtom(3)) == state and after(State(), ask.ShowAtom(0)) == State()
    state = after(state, ask.ShowAtom(2), ask.OpenDictionary(True))
    assert (state.scene.mode, state.asking.atom, state.preferences.dictionary_open) == (
        pictures.WEIGHT,
        2,
        True,
    )
    state = after(state, ask.ChooseAtom(2, True), ask.ChooseAtom(0, True), ask.ChooseAtom(2, True))
    assert state.asking.chosen == (0, 2)
    assert after(state, ask.ChooseAtom(0, False)).asking.chosen == (2,)
    assert after(state, ask.ChooseNone()).asking.chosen == ()


def test_one_phrase_may_have_a_negative_margin() -> None:
    assert margin_span(1) == (-0.5, 0.5) and margin_span(2)[0] == margin_span(8)[0] == 0


def test_the_first_phrase_turns_the_heat_map_on_and_only_the_first() -> None:
    state = after(State(), ask.EditPrompt(0, "d"))
    assert state.scene.mode is pictures.HEAT
    state = after(state, camera.SetMode(pictures.RGB), ask.EditPrompt(0, "do"))
    assert state.scene.mode is pictures.RGB
    assert after(State(), ask.EditPrompt(0, "  ")).scene.mode is pictures.RGB


def test_prompts_are_edited_by_key() -> None:
    state = after(State(), ask.EditPrompt(0, "door"), ask.AddPrompt())
    second = state.asking.prompts[1]
    assert second.colour != state.asking.prompts[0].colour and state.asking.active == second.key
    state = after(state, ask.EditPrompt(second.key, "floor"), ask.ShowPrompt(second.key, False))
    assert [p.text for p in state.asking.asked] == ["door"]
    assert state.asking.active_prompt == state.asking.prompts[0]
    state = after(state, ask.RemovePrompt(0), ask.RemovePrompt(second.key))
    assert (
        len(state.asking.prompts) == 1
        and state.asking.prompts[0].text == ""
        and state.asking.active_prompt is None
    )


def test_found_follows_the_threshold_in_force() -> None:
    state = after(State(), ask.EditPrompt(0, "door"))
    assert state.asking.prompts[0].found is None
    state = after(state, ask.Calibrated(0.8), ask.Answered(((0, "door", 0.7), (99, "x", 0.9))))
    assert state.asking.prompts[0].found is False
    assert after(state, ask.SetThreshold(0, 0.6)).asking.prompts[0].found is True
    back = after(state, ask.SetThreshold(0, 0.6), ask.SetThreshold(0, None))
    assert back.asking.prompts[0].cut == 0.8
    edited = after(state, ask.EditPrompt(0, "doors"))
    assert edited.asking.prompts[0].score is None
    assert after(edited, ask.Answered(((0, "door", 0.7),))).asking.prompts[0].score is None  # of the old text


def test_negatives_and_what_needs_weight_maps() -> None:
    state = after(State(), ask.SetNegatives(("thing",)))
    assert state.asking.negatives == ("thing",) and State().asking.negatives == ()
    assert not after(State(), camera.SetMode(pictures.HEAT)).wants_maps
    assert after(State(), camera.SetMode(pictures.ATOMS)).wants_maps
    asked = after(State(), ask.EditPrompt(0, "door"))
    assert asked.wants_maps and after(asked, camera.SetMode(pictures.DEPTH)).wants_maps  # it has no score yet
    answered = after(asked, ask.Answered(((0, "door", 0.9),)), camera.SetMode(pictures.DEPTH))
    assert answered.asking.prompts[0].score == 0.9 and not answered.wants_maps


def test_without_own_negatives_the_scene_says_what_phrases_are_compared_with() -> None:
    query: Any = SimpleNamespace(threshold=0.7, negative_texts=("wall",))
    state = ask.PhrasesCompiled((), query).apply(State())
    assert (state.asking.negatives, state.asking.usual) == ((), ("wall",))
    own = ask.PhrasesCompiled((), query).apply(State().with_asking(negatives=("thing",)))
    assert own.asking.usual != ("wall",)


def test_a_range_of_colours_is_kept_in_order_and_apart() -> None:
    state = after(shown_scene(), ask.SetSpan((0.9, 0.2)))
    assert state.asking.span == (0.2, 0.9) and state.heat_colours.ends(0.5) == (0.2, 0.9)
    low, high = after(state, ask.SetSpan((1.0, 1.0))).asking.span or (0, 0)
    assert 0 <= low < high <= 1.01
    assert after(state, ask.SetSpan(None)).heat_colours.ends(0.4)[0] < 0.4


def test_a_reading_is_shown_until_the_words_change() -> None:
    query: Any = SimpleNamespace(threshold=0.8, negative_texts=())
    state = after(asked("white chair"), ask.PhrasesCompiled((0,), query, 0, ("",), ("chair, white",)))
    assert state.asking.prompts[0].reading == "chair, white"
    assert after(state, ask.EditPrompt(0, "white chairs")).asking.prompts[0].reading == ""


def test_a_reading_that_is_taken_away_leaves_the_phrase_within_quotes() -> None:
    state = after(asked(' the "white" chair '), ask.AskWhole(0))
    assert (
        state.asking.prompts[0].text == '"the white chair"'
        and read_phrase(state.asking.prompts[0].text).whole
    )
    empty = after(State(), ask.AskWhole(0), ask.AskWhole(99))
    assert empty.asking.prompts == State().asking.prompts


def test_what_a_view_says_of_a_reading_is_noted_with_its_phrase() -> None:
    told: Any = {"name": (), "relevance": torch.zeros(1, 1, 1)}
    state = after(asked("blue chair"), ask.Narrowed(**told, notes=((0, "blue chair", "none looks blue"),)))
    assert state.asking.prompts[0].note == "none looks blue"
    other = ask.Narrowed(**told, notes=((0, "red chair", "another"),))
    lapsed = ask.Narrowed(**told, notes=((0, "blue chair", "late"),), revision=7)
    assert after(state, other, lapsed).asking.prompts[0].note == "none looks blue"
