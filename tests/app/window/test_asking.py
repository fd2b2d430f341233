"""Asking without a window: commands, prompt sets, histograms, and what is said about atoms."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from app.window import ask_commands as ask
from app.window import ask_messages, insight, messages
from app.window import commands as do
from app.window.asking import BINS, MOST_RECENT, Histogram, margin_span, unfinished, usable
from app.window.prompt_sets import MOST_PROMPTS, PromptSet, read_prompts, write_prompts
from app.window.state import PALETTE, Mode, Prompt, State
from app.window.worker import Worker, describe_scene
from langflash_core.errors import OutputError, PromptError
from langflash_core.language.algebra import terms
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import language_space
from langflash_core.splat import render
from langflash_core.types import Semantics
from tests.app.window.scenes import CHAIR, PHRASES, room
from tests.app.window.test_commands import after
from tests.app.window.test_worker import wait_for


@pytest.fixture(scope="module")
def info():
    return describe_scene(room(torch.eye(3)), serial=1, name="room")


def asked(*texts: str) -> State:
    state = after(State(), do.EditPrompt(0, texts[0]))
    for text in texts[1:]:
        state = after(state, do.AddPrompt())
        state = after(state, do.EditPrompt(state.active, text))
    return state


# Phrases


def test_recent_phrases_are_kept_once_newest_first_and_bounded() -> None:
    state = after(State(), ask.Remember("door"), ask.Remember(" red  door "), ask.Remember("door"))
    assert state.asking.recent == ("door", "red door")
    state = after(state, ask.Remember("   "), *(ask.Remember(str(n)) for n in range(MOST_RECENT + 5)))
    assert len(state.asking.recent) == MOST_RECENT and state.asking.recent[0] == str(MOST_RECENT + 4)


def test_a_recent_phrase_takes_an_empty_row_or_a_new_one() -> None:
    state = after(State(), do.Calibrated(0.7), ask.AskAgain("sofa"))
    assert [p.text for p in state.prompts] == ["sofa"] and state.mode is Mode.HEAT
    state = after(state, do.SetMode(Mode.DEPTH), ask.AskAgain("rug"))
    assert [p.text for p in state.prompts] == ["sofa", "rug"]
    assert state.active == state.prompts[1].key and state.mode is Mode.DEPTH
    assert state.prompts[1].colour != state.prompts[0].colour and state.prompts[1].cut == 0.7
    assert state.asking.recent == ("rug", "sofa")
    full = asked(*(str(n) for n in range(MOST_PROMPTS)))
    assert after(full, ask.AskAgain("one more")) == full


@pytest.mark.parametrize("text", ["chair -", "+ chair", "chair - ", "- ", "-", " sofa +  "])
def test_an_unfinished_sum_is_not_asked(text: str) -> None:
    assert unfinished(text) and not usable(text)
    assert asked(text).asked == ()
    with pytest.raises(PromptError):  # the library refuses what the window holds back
        terms(text)


@pytest.mark.parametrize("text", ["chair - armchair", "t-shirt", "C++ book", "sofa + cushion", "-5"])
def test_a_whole_phrase_is_asked(text: str) -> None:
    assert usable(text) and len(asked(text).asked) == 1
    assert terms(text)


def test_what_each_mode_needs() -> None:
    for mode in Mode:
        silent, spoken = (replace(state, mode=mode) for state in (State(), asked("door")))
        assert silent.wants_maps == mode.of_atoms
        assert spoken.wants_maps  # to be answered
        answered = replace(spoken, prompts=tuple(replace(p, score=0.9) for p in spoken.prompts))
        assert answered.wants_maps == (mode.of_atoms or mode.answers)
    assert not any(mode.of_atoms and mode.answers for mode in Mode)


def test_modes_that_the_scene_cannot_show(info) -> None:
    assert not any(mode.possible(None) for mode in Mode)
    assert not info.own_views and {m for m in Mode if not m.possible(info)} == {Mode.AGREEMENT}
    assert Mode.AGREEMENT.possible(replace(info, own_views=True))
    bare = replace(info, views=(), num_atoms=0)
    assert {m for m in Mode if not m.possible(bare)} == {
        Mode.AGREEMENT, Mode.COVERAGE, Mode.WEIGHT, Mode.FEATURES,
    }  # fmt: skip


def test_a_histogram_belongs_to_the_text_it_was_made_for() -> None:
    state = asked("door")
    made = Histogram(0, "door", (1,) * BINS)
    state = after(state, ask.Binned((made,)))
    assert state.asking.histogram(0, " door ") == made
    assert state.asking.histogram(0, "doors") is None and state.asking.histogram(1, "door") is None


def test_another_scene_forgets_the_old_ones_atoms_but_no_phrases(info) -> None:
    state = after(State(), do.SceneArrived(info), ask.ShowAtom(2), ask.ChooseAtom(1, True))
    state = after(state, ask.Remember("door"), ask.Binned((Histogram(0, "door", (0,) * BINS),)))
    state = after(state, do.SceneArrived(replace(info, serial=2)))
    assert (state.asking.atom, state.asking.chosen, state.asking.histograms) == (0, (), ())
    assert state.asking.recent == ("door",)


def test_atoms_are_shown_and_chosen(info) -> None:
    state = after(State(), do.SceneArrived(info))
    assert after(state, ask.ShowAtom(3)) == state and after(State(), ask.ShowAtom(0)) == State()
    state = after(state, ask.ShowAtom(2), ask.OpenDictionary(True))
    assert (state.mode, state.asking.atom, state.desk.preferences.dictionary_open) == (Mode.WEIGHT, 2, True)
    state = after(state, ask.ChooseAtom(2, True), ask.ChooseAtom(0, True), ask.ChooseAtom(2, True))
    assert state.asking.chosen == (0, 2)
    assert after(state, ask.ChooseAtom(0, False)).asking.chosen == (2,)
    assert after(state, ask.ChooseNone()).asking.chosen == ()


def test_one_phrase_may_have_a_negative_margin() -> None:
    assert margin_span(1) == (-0.5, 0.5) and margin_span(2)[0] == margin_span(8)[0] == 0


# Prompt sets


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
    state = after(State(), do.Calibrated(0.7), ask.PromptsRead(path, found))
    assert [p.text for p in state.prompts] == [p.text for p in found.prompts]
    assert len({p.key for p in state.prompts}) == 2 and state.next_key > max(p.key for p in state.prompts)
    assert (state.active, state.mode) == (state.prompts[0].key, Mode.LABELS)
    assert [p.cut for p in state.prompts] == [0.625, 0.7]
    assert state.asking.prompts_path == path and state.negatives == ("stuff", "things")


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
    assert state.negatives == State().negatives  # none in the file: the usual ones stay


def test_a_set_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        write_prompts(a_set(), tmp_path / "missing" / "x.json")
    assert list(tmp_path.iterdir()) == []


def test_the_dialogs_propose_a_place_and_close(tmp_path: Path) -> None:
    state = after(State(), do.ShowDialog("save prompts"))
    assert state.dialog == "save prompts" and state.dialog_path.endswith(".prompts.json")
    state = after(state, ask.SavePrompts(tmp_path / "a.json"), do.ShowDialog("load prompts"))
    assert state.dialog_path == str(tmp_path / "a.json")
    assert after(state, ask.LoadPrompts(tmp_path / "a.json")).dialog is None


# The worker's side


@pytest.fixture(scope="module")
def scene():
    return room(language_space("minilm").encode(list(PHRASES)))


def test_the_worker_writes_and_reads_sets_and_lives_on_after_a_bad_one(tmp_path: Path) -> None:
    worker = Worker()
    path = tmp_path / "a.prompts.json"
    worker.submit(ask_messages.ReadPrompts(path))
    failed = wait_for(worker, messages.Failed)[-1]
    assert not failed.job and "a.prompts.json" in failed.sentence
    worker.submit(ask_messages.WritePrompts(a_set(), path))
    assert wait_for(worker, ask_messages.PromptsWritten)[-1].path == path
    worker.submit(ask_messages.ReadPrompts(path))
    assert wait_for(worker, ask_messages.PromptsLoaded)[-1].chosen == read_prompts(path)
    worker.stop()


def test_histograms_count_covered_pixels_by_score(scene) -> None:
    query = compile_query(scene, language_space("minilm"), ["armchair", "elephant"])
    camera = scene.camera(0, 56, 42)
    frame = render(scene, camera)
    assert frame.weight_maps is not None
    relevance = relevance_maps(frame.weight_maps, query)
    made = insight.bin_scores(messages.Answer(3, (5, 8), relevance, frame, camera, query))
    assert made.serial == 3 and [(h.key, h.text) for h in made.histograms] == [
        (5, "armchair"),
        (8, "elephant"),
    ]
    covered = frame.alphas >= 0.5
    for histogram, values in zip(made.histograms, relevance, strict=True):
        inside = values[covered].tolist()
        assert sum(histogram.counts) == len(inside)
        above = sum(value >= 0.8 for value in inside)
        assert sum(histogram.counts[round(0.8 * BINS) :]) == above
    assert made.histograms[0].counts[-1] > 0 == made.histograms[1].counts[-1]


def test_atoms_are_described(scene) -> None:
    found = insight.describe_atoms(ask_messages.DescribeAtoms(6, scene))
    assert found.serial == 6 and len(found.thumbnails) == 3
    mine = found.insight
    ids = scene.semantics.weight_ids[:, 0]
    shares = [(ids == k).float().mean().item() for k in range(3)]  # all of one opacity
    np.testing.assert_allclose(mine.shares, shares, atol=1e-6)
    unit = scene.semantics.dictionary.double().numpy()
    cosines = [[float(a @ b / np.linalg.norm(a) / np.linalg.norm(b)) for b in unit] for a in unit]
    np.testing.assert_allclose(mine.similarity, cosines, atol=1e-12)
    assert sorted(mine.order) == [0, 1, 2] and len(mine.colours) == 3


def test_a_thumbnail_shows_where_a_photo_carries_the_atom(scene) -> None:
    """The photo's pixels say where they are: red is the column, green the row."""
    width, height = scene.view_size
    places = np.stack(np.meshgrid(np.linspace(0, 255, width), np.linspace(0, 255, height)), -1)
    photo = Image.fromarray(np.concatenate((places, 0 * places[..., :1]), -1).astype(np.uint8))
    stream = io.BytesIO()
    photo.save(stream, "PNG")
    pictures = insight.thumbnails(replace(scene, photos=(stream.getvalue(),) * 2))
    shown = [picture for picture in pictures if picture is not None]
    assert [picture.shape for picture in shown] == 3 * [(96, 96, 3)]
    chair, wall, floor = (picture[..., :2].mean((0, 1)) for picture in shown)
    places = []
    for seen in (scene.camera(view) for view in range(2)):
        viewmat = seen.viewmat.numpy()
        places.append(seen.K.numpy() @ (viewmat[:3, :3] @ np.array(CHAIR) + viewmat[:3, 3]))
    columns = [255 * p[0] / p[2] / width for p in places]
    assert min(abs(chair[0] - column) for column in columns) < 45  # a window of the block's own width
    assert wall[1] < 127 < floor[1]  # above and below the horizon


def test_atoms_without_photos_or_numbers_do_no_harm(scene) -> None:
    broken = scene.semantics.dictionary.clone()
    broken[1] = torch.nan
    poor = replace(
        scene,
        photos=(b"no picture", b""),
        semantics=replace(scene.semantics, dictionary=broken),
    )
    found = insight.describe_atoms(ask_messages.DescribeAtoms(1, poor))
    assert found.thumbnails == (None, None, None) and np.isfinite(found.insight.similarity).all()
    ids, values = poor.semantics.weight_ids[:, :0], poor.semantics.weight_values[:, :0]
    none = replace(poor, semantics=Semantics(ids, values, broken[:0], poor.semantics.space), photos=())
    empty = insight.describe_atoms(ask_messages.DescribeAtoms(1, none))
    assert (empty.insight.shares, empty.insight.order, empty.thumbnails) == ((), (), ())


def test_alike_rows_stand_side_by_side() -> None:
    vectors = np.array([[1, 0], [0, 1], [0.99, 0.14], [0.14, 0.99]])
    order = insight.alike_order(vectors @ vectors.T)
    assert abs(order.index(0) - order.index(2)) == abs(order.index(1) - order.index(3)) == 1
