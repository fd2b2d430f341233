"""Found, maybe, not found; what the scene knows; phrases in another language."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from imgui_bundle import imgui, implot

from app.window.asking import commands as ask
from app.window.asking import things
from app.window.asking.panels import prompts, scores
from app.window.asking.panels.known import KNOWS
from app.window.asking.state import BINS, Histogram, Insight, Prompt
from app.window.asking.work import Encode
from app.window.editing.pointing import AtomsNamed
from app.window.editing.work import NameAtoms
from app.window.inventory.state import Row
from app.window.kit import theme
from app.window.kit.look import Look
from app.window.scene.panels import tray
from app.window.scene.state import Photo
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.base.resources import asset_path
from langflash_core.geometry.poses import Vector
from langflash_core.language.answers import best_places
from langflash_core.language.hints import reads_foreign
from langflash_core.language.settings import ANSWERING
from langflash_core.language.spaces import language_space
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import History, delete
from langflash_core.scene.mask import Mask
from langflash_core.splat import render
from langflash_core.types import Frame
from tests.app.window.headless import context, frames, look
from tests.app.window.rows import Rows
from tests.app.window.scenes import PHRASES, after, room, shown_scene


@pytest.mark.parametrize(
    "score, found, maybe", [(0.9, True, False), (0.84, False, True), (0.76, False, True), (0.7, False, False)]
)
def test_a_near_miss_is_neither_found_nor_not(score: float, found: bool, maybe: bool) -> None:
    prompt = Prompt(0, "curtain", score=score, calibrated=0.85)
    assert (prompt.found, prompt.maybe) == (found, maybe)
    assert prompt.shown_from < prompt.cut if maybe else prompt.shown_from == prompt.lit_from


def test_a_phrase_glows_from_half_of_its_score_unless_a_person_chose_the_threshold() -> None:
    asked = Prompt(0, "door", score=0.98, calibrated=0.79)
    assert asked.lit_from == pytest.approx(0.875, abs=1e-6)
    assert replace(asked, threshold=0.6).lit_from == 0.6
    assert replace(asked, score=0.7).lit_from == replace(asked, score=None).lit_from == 0.79


def test_what_fits_no_better_than_anything_is_never_maybe() -> None:
    for cut in (0.3, 0.5, 0.85, 1.0):
        prompt = Prompt(0, "x", threshold=cut, score=min(ANSWERING.even, cut) - 0.01)
        assert not prompt.maybe and prompt.lowest <= cut


def test_an_answer_says_where_it_fits_best_until_the_words_change() -> None:
    place = Vector(1.0, 2.0, 3.0)
    state = after(shown_scene(), ask.Answered(((0, "door", 0.8),), 0, (place,)))
    assert state.asking.prompts[0].place == place
    assert after(state, ask.EditPrompt(0, "doors")).asking.prompts[0].place is None
    assert after(shown_scene(), ask.Answered(((0, "door", 0.8),))).asking.prompts[0].score == 0.8


def test_the_best_place_is_where_the_map_is_highest() -> None:
    scene = room(torch.eye(3))
    camera = scene.camera(0, 56, 42)
    frame = render(scene, camera, weight_maps=False)
    relevance = torch.zeros(2, 42, 56)
    relevance[0, 30, 10] = 0.7
    relevance[1, 5, 40] = 0.6
    first, second = best_places(relevance, frame, camera)
    assert first is not None and second is not None
    assert first[2] == pytest.approx(float(frame.depths[30, 10]), abs=1e-5)
    assert first[0] < 0 < second[0] and first[1] > 0 > second[1]
    empty = Frame(torch.zeros(42, 56, 3), torch.zeros(42, 56), torch.zeros(42, 56))
    assert best_places(relevance, empty, camera) == (None, None)


@pytest.mark.parametrize("text", ["stuhl", "die lampe", "fenêtre", "silla", "der teppich", "椅子家具"])
def test_another_language_is_told(text: str) -> None:
    assert reads_foreign(text)


@pytest.mark.parametrize(
    "text", ["armchair", "bookcases", "a red doormat", "café table", "tv", "", "12", "typewriter"]
)
def test_english_is_not(text: str) -> None:
    assert not reads_foreign(text)


def test_a_foreign_phrase_is_marked_with_its_compiled_question() -> None:
    scene = room(language_space("minilm").encode(list(PHRASES)))
    encode = Encode(
        1, scene, (4, 7, 9), ("stuhl", "chair", "haus"), (), (b"", b"", bytes(4 * 383) + b"\0\0\x80?")
    )
    compiled, _ = encode.run(lambda: False)
    assert isinstance(compiled, ask.PhrasesCompiled) and [bool(note) for note in compiled.notes] == [
        True,
        False,
        False,
    ]
    state = shown_scene().with_asking(prompts=(Prompt(4, "stuhl"), Prompt(7, "chair", note="old")))
    state = after(state, compiled)
    assert [prompt.note for prompt in state.asking.prompts] == [compiled.notes[0], ""]


def test_chips_are_what_the_scene_shows_most_of_each_once() -> None:
    state = shown_scene()
    assert things.things(state) == ()
    black = (0.0, 0.0, 0.0)
    insight = Insight((0.2, 0.5, 0.001), (black, black, black), (0, 1, 2), np.eye(3))
    names = AtomsNamed((("wall", "side"), ("Floor",), ("crumb",)), ("wall", "Floor", "crumb"))
    assert state.scene.info is not None
    history = History(first_marks(state.scene.info.scene))
    state = state.with_editing(history=history)
    state = after(state, ask.AtomsDescribed(insight), names)
    assert things.things(state) == ("floor", "wall")
    silent = tuple(replace(atom, on=k != 1) for k, atom in enumerate(history.marks.atoms))
    marks = replace(history.marks, atoms=silent)
    muted = state.with_editing(history=History(marks))
    assert things.things(muted) == ("wall",)
    unanswered = after(state, replace(names, found=("wall",)))
    assert things.things(unanswered) == ("wall",), "a chip that is asked is found"
    row = Row(
        "lamp 1", "lamp", 0.9, (0, 0, 0), (1, 1, 1), 0.0, (0,), False, Mask.first(4, 1), np.zeros((8, 3))
    )
    listed = unanswered.with_listing(rows=(row,))
    assert things.things(listed) == ("wall", "lamp"), "what the inventory lists is a chip"
    assert things.told(listed) == {"wall": 0}


def test_names_of_groups_are_those_that_the_scene_answers() -> None:
    """A group that is a little of everything is no thing that one finds, whatever word is nearest to it."""
    scene = room(language_space("minilm").encode(list(PHRASES)))
    info = describe_scene(scene, serial=1, name="room")
    (named,) = NameAtoms(1, info.memory, first_marks(scene)).run(lambda: False)
    assert isinstance(named, AtomsNamed) and named.found == tuple(row[0] for row in named.names)
    own, floor = scene.semantics.weight_values, torch.full_like(scene.semantics.weight_ids, 2)
    ids, values = torch.cat((scene.semantics.weight_ids, floor), 1), torch.cat((0.1 * own, 0.9 * own), 1)
    faint = replace(scene, semantics=replace(scene.semantics, weight_ids=ids, weight_values=values))
    memory = describe_scene(faint, serial=2, name="room").memory
    (named,) = NameAtoms(2, memory, first_marks(faint)).run(lambda: False)
    assert isinstance(named, AtomsNamed) and named.found == (named.names[2][0],)


def test_a_phrase_that_is_not_found_names_the_photo_that_shows_it() -> None:
    scene = room(language_space("minilm").encode(list(PHRASES)))
    ids = (scene.semantics.weight_ids[:, 0] == 0).long()  # the second photo's are armchairs alone
    owned = replace(scene, view_ids=ids)
    marks = first_marks(owned)
    encode = Encode(1, owned, (4, 7), ("armchair", "submarine"), (), marks=marks)
    compiled, placed = encode.run(lambda: False)
    assert placed == ask.PhrasesPlaced((4, 7), ("armchair", "submarine"), (1, None))
    gone = delete(marks, Mask.of(ids.numpy() == 1))
    *_, without = replace(encode, marks=gone).run(lambda: False)
    assert isinstance(without, ask.PhrasesPlaced) and without.photos == (None, None)
    prompts = Prompt(4, "armchair", photo=0), Prompt(7, "submarine now")
    state = after(shown_scene().with_asking(prompts=prompts), compiled, placed)
    assert [prompt.photo for prompt in state.asking.prompts] == [1, None]
    typed = after(state, ask.EditPrompt(4, "armchairs"))
    assert typed.asking.prompts[0].photo is None
    assert after(typed, placed).asking.prompts[0].photo is None, "an answer to other words"


def test_the_photo_that_shows_it_is_one_click_away(monkeypatch) -> None:
    rows = Rows(monkeypatch)
    state = shown_scene().with_asking(prompts=(Prompt(0, "door", score=0.1, photo=1),))

    def shown(state: State) -> list[str]:
        with context((500, 500)):
            theme.set_up(1.0, "dark")
            frames(lambda seen: prompts.draw(state, seen), look())
        return [row.words for row in rows.now() if row.kind == "small_button"]

    assert shown(state.with_scene(view=0)) == ["Photo 2 shows it"]
    read = Prompt(0, "purple wall", score=0.4, photo=1, reading="wall, purple")
    assert shown(state.with_asking(prompts=(read,)).with_scene(view=0)) == ["Photo 2 shows wall"], "no colour"
    here = replace(read, score=0.0)  # a wall, but no purple one
    assert shown(state.with_asking(prompts=(here,)).with_scene(view=0)) == []
    assert shown(state.with_scene(view=1)) == []
    assert shown(state.with_asking(prompts=(Prompt(0, "door", score=0.9, photo=1),))) == []


@pytest.mark.parametrize(
    ("reading", "score", "told"), [("", 0.9, 1), ("wall, red", 0.9, 1), ("wall, red", 0.0, 0)]
)
def test_what_a_score_is_worth_is_not_told_of_what_was_not_scored(
    monkeypatch, reading: str, score: float, told: int
) -> None:
    """ "A score of 0.00 is right 5 % of the time", of a wall that is not red."""
    rows, state = Rows(monkeypatch), shown_scene()
    known = {"reliability": {"photos": [{"score": 0.1, "present": 0.0}, {"score": 0.9, "present": 1.0}]}}
    assert state.scene.info is not None
    scene = state.scene.info.scene.with_record(calibration=known)
    state = state.with_scene(info=replace(state.scene.info, scene=scene))
    prompt = Prompt(0, "red wall", score=score, reading=reading)
    state = state.with_asking(prompts=(prompt,), histograms=(Histogram(0, "red wall", (1,) * BINS),))
    with context((500, 500)):
        implot.create_context()
        theme.set_up(1.0, "dark")
        frames(lambda seen: scores.draw(state, seen), look())
        implot.destroy_context()
    assert sum("of the time" in row.words for row in rows.now()) == told


def test_a_threshold_is_where_its_line_is_let_go(monkeypatch) -> None:
    """Where frames are slow the last move and the release come in one."""
    prompt = Prompt(0, "door", score=0.5, threshold=0.3)
    states = [shown_scene().with_asking(prompts=(prompt,), histograms=(Histogram(0, "door", (1,) * BINS),))]
    places, end = [], implot.end_plot

    def end_plot() -> None:
        places[:] = [implot.plot_to_pixels(score, 0.5) for score in (0.3, 0.6, 0.9)]
        end()

    def draw(seen: Look) -> None:
        for command in scores.draw(states[-1], seen):
            states.append(after(states[-1], command))

    monkeypatch.setattr(implot, "end_plot", end_plot)
    with context((500, 500)):
        implot.create_context()
        theme.set_up(1.0, "dark")
        frames(draw, look())
        line, nearer, there = places
        io = imgui.get_io()
        for down in (True, False, True):  # a click alone moves nothing
            io.add_mouse_pos_event(line.x, line.y)
            io.add_mouse_button_event(0, down)
            frames(draw, look(), 2)
        assert len(states) == 1
        io.add_mouse_pos_event(nearer.x, nearer.y)
        frames(draw, look(), 1)
        io.add_mouse_pos_event(there.x, there.y)
        io.add_mouse_button_event(0, False)
        frames(draw, look(), 2)
        implot.destroy_context()
    assert states[-1].asking.prompts[0].threshold == pytest.approx(0.9, abs=0.01)


def test_a_chip_asks_its_word() -> None:
    state = after(shown_scene(), ask.AskAgain("floor"))
    assert [prompt.text for prompt in state.asking.prompts] == ["door", "floor"]


def test_what_the_model_knows_is_what_its_card_says() -> None:
    card = asset_path("weights/mini_card.md").read_text()
    found = re.search(r"(\d+) classes, atoms drawn: mIoU / accuracy \| \.\d+ / (\.\d+) ", card)
    assert found is not None
    assert f"{float(found[2]):.0%}".replace("%", " %") in KNOWS and f"({found[1]} kinds" in KNOWS


def test_one_photo_is_told_to_leave_depth_a_guess() -> None:
    state = shown_scene()
    assert state.scene.info is not None
    one = state.with_scene(info=replace(state.scene.info, views=state.scene.info.views[:1]))
    told = [sentence for sentence in tray._sentences(one) if "depth is guessed" in sentence.lower()]
    assert len(told) == 1
    assert not any("guess" in sentence.lower() for sentence in tray._sentences(state))


def test_the_lens_is_told_by_photos_that_are_there() -> None:
    state = shown_scene()
    assert state.scene.info is not None
    said = "the photos do not record their lens, so a field of view of 65° is assumed; set it with --fov"
    state = state.with_scene(info=replace(state.scene.info, warnings=(said,)), photos=())
    assert tray.WITHOUT_PHOTOS in tray._sentences(state)[0] and "--fov" not in tray._sentences(state)[0]
    before = "assumed field of view 65 degrees; on the command line, --fov tells it"  # in files of before
    assert tray.said_here(before).endswith(f"{tray.HOW_TO_TELL}.")
    beside = state.with_scene(photos=(Photo(Path("a.jpg")),))
    assert tray.HOW_TO_TELL in tray._sentences(beside)[0]
