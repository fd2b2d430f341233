"""Phrases that choose among what answers their heads: what the picture shows, and when."""

from dataclasses import replace

import numpy as np
import pytest

from app.window.asking.commands import Answered, Narrowed
from app.window.asking.work import Answer
from app.window.drawing.card import CardPicture
from app.window.drawing.processor import ProcessorPicture
from app.window.drawing.values import View
from app.window.scene.memory import SceneMemory
from app.window.state import State
from langflash_core.base import pictures
from langflash_core.geometry.poses import orbit
from langflash_core.language.spaces import language_space
from langflash_core.language.spoken import compile_spoken
from langflash_core.scene.edits import delete
from langflash_core.scene.mask import Mask
from tests.app.window.test_viewport import SIZE, living, showing, spoken_room


@pytest.mark.parametrize("picture", [ProcessorPicture, CardPicture])
def test_what_a_phrase_does_not_mean_leaves_the_picture_and_no_splat_is_drawn(viewport, picture) -> None:
    """The armchair is red and stands before the wall: by its colour and its place it is told from others."""
    space = language_space("minilm")
    scene = spoken_room()
    state = showing(scene, mode=pictures.HEAT)
    viewport.set_scene(1, scene)
    if picture is CardPicture:
        viewport.picture = CardPicture(viewport._made(), 1, scene)

    def shown() -> np.ndarray:
        viewport.update(state, SIZE, touched=0.0)
        pixels = viewport.seen()
        assert pixels is not None
        return pixels

    def ask(*phrases: str) -> None:
        nonlocal state
        query = compile_spoken(scene, space, phrases)
        asked = tuple(
            replace(state.asking.prompts[0], key=key, text=phrase, calibrated=query.threshold)
            for key, phrase in enumerate(phrases)
        )
        state = state.with_asking(prompts=asked)
        viewport.ask(tuple(range(len(phrases))), query, state.asking.revision)

    def seen(phrase: str) -> tuple[Narrowed | None, Answered, np.ndarray]:
        """The answer, and the picture once it is narrowed."""
        nonlocal state
        ask(phrase)
        view, frames = None, living(viewport, state, count=600)
        for state in frames:
            view = viewport.view(state) or view
            whole = viewport.whole and not viewport.settling
            if whole and view is not None and tuple(view.frame.alphas.shape) == SIZE[::-1]:
                break
        assert view is not None
        done = Answer(1, view).run(lambda: False)
        told = [each for each in done if isinstance(each, Narrowed | Answered)]
        narrowed = next((each for each in told if isinstance(each, Narrowed)), None)
        if narrowed is not None:
            assert np.array_equal(shown(), colours), "until then every armchair would light up under its name"
            viewport.narrow(narrowed.name, narrowed.relevance)
        pixels = shown()
        return narrowed, next(each for each in told if isinstance(each, Answered)), pixels.astype(int)

    _, _, plain = seen("armchair")
    heat, state = state, state.with_scene(mode=pictures.RGB)
    colours, state = shown(), heat
    passes = dict(viewport.stats().passes)
    kept, _, red = seen("red armchair in front of the wall")
    ask("red armchair in front of the wall", "door")
    assert not np.array_equal(shown(), colours), "a second phrase takes no heat from the first"
    gone, none, blue = seen("blue armchair")
    assert kept is not None and gone is not None and float(kept.relevance.max()) > 0.9
    assert none.scores[0][2] == 0 and gone.notes[0][2] == "no armchair here looks blue"
    assert abs(red - plain).max() <= 1 and abs(blue - plain).max() > 50, "a rounding; colours of heat"
    again, _, whole = seen('"blue armchair"')
    assert again is None and abs(whole - blue).max() > 50
    after = dict(viewport.stats().passes)
    splatted = ("colour", "weights")
    assert [after.get(kind) for kind in splatted] == [passes.get(kind) for kind in splatted]


@pytest.fixture
def red(viewport) -> State:
    """A room of which "red armchair" is asked."""
    scene = spoken_room()
    state = showing(scene, mode=pictures.HEAT)
    viewport.set_scene(1, scene)
    query = compile_spoken(scene, language_space("minilm"), ["red armchair"])
    viewport.ask((state.asking.prompts[0].key,), query, state.asking.revision)
    return state


def rested(viewport, state: State) -> View:
    """The view that is to be scored of the picture at rest."""
    view = None  # is given once, also before the picture has settled
    for frame in living(viewport, state, count=600):
        view = viewport.view(frame) or view
        if view is not None and viewport.whole and not viewport.settling:
            return view
    raise AssertionError("it never rests")


def test_an_answer_that_comes_behind_its_picture_is_asked_for_again(viewport, red) -> None:
    """The window closed: a smaller picture, of a hand that moves, was to be painted by the one before."""
    first = rested(viewport, red)
    viewport.update(red, (SIZE[0] // 2, SIZE[1] // 2), touched=0.0)
    viewport.narrow(first.name, first.relevance)
    second = rested(viewport, red)
    assert second.name == first.name and second.relevance.shape == first.relevance.shape


def test_a_chosen_phrase_lights_nothing_in_a_picture_of_which_it_is_not_told(viewport, red) -> None:
    """Behind an edit or a turn every armchair lit up as the red one, as long as the worker was busy."""
    marks, info = red.editing.marks, red.scene.info
    assert marks is not None and info is not None
    viewport.mark(SceneMemory(info.scene), marks, None)

    def lit(state: State) -> bool:
        """Whether the picture on show has heat."""
        seen = []
        for mode in (pictures.HEAT, pictures.RGB):
            viewport.update(state.with_scene(mode=mode), SIZE, touched=0.0)
            seen.append(viewport.seen())
        return not np.array_equal(*seen)

    def tell(state: State) -> None:
        view = rested(viewport, state)
        assert not lit(state)
        viewport.narrow(view.name, view.relevance)
        assert lit(state)

    tell(red)
    viewport.mark(SceneMemory(info.scene), delete(marks, Mask.first(marks.selected.count, 90)), None)
    tell(red)
    turned = red.with_scene(pose=orbit(red.scene.pose, 0.1, 0.0))
    viewport.update(turned, SIZE, touched=turned.now)  # and back before it rests
    tell(red)
    tell(turned)
