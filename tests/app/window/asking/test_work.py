"""The worker's side of asking."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from app.window import commands as do
from app.window.asking import commands as ask
from app.window.asking import work
from app.window.asking.prompt_sets import read_prompts
from app.window.asking.state import BINS
from app.window.asking.work import Encode
from app.window.drawing.values import View
from app.window.editing import work as editing_work
from app.window.editing.effects import EditingEffects
from app.window.effects import Hands
from app.window.scene.commands import SceneArrived
from app.window.scene.work import describe_scene
from app.window.state import State
from app.window.viewport import Viewport
from app.window.worker import Worker
from langflash_core.geometry.surfels import covered_areas
from langflash_core.language import minilm
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import encode_cached, language_space
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import Mask, delete
from langflash_core.splat import render
from langflash_core.types import Semantics
from tests.app.window.asking.test_prompt_sets import a_set
from tests.app.window.scenes import PHRASES, after, room
from tests.app.window.test_worker import wait_for


@pytest.fixture(scope="module")
def scene():
    return room(language_space("minilm").encode(list(PHRASES)))


def test_the_worker_writes_and_reads_sets_and_lives_on_after_a_bad_one(tmp_path: Path) -> None:
    worker = Worker()
    path = tmp_path / "a.prompts.json"
    worker.submit(work.ReadPrompts(path))
    failed = wait_for(worker, do.Notify)[-1]
    assert failed.kind == "error" and "a.prompts.json" in failed.text
    worker.submit(work.WritePrompts(a_set(), path))
    saved = wait_for(worker, do.Notify)[-1]
    assert (saved.kind, saved.text) == ("info", f"Saved {path}")
    worker.submit(work.ReadPrompts(path))
    read = wait_for(worker, ask.PromptsRead)[-1]
    assert (read.path, read.chosen) == (path, read_prompts(path))
    worker.stop()


def test_histograms_count_covered_pixels_by_score(scene) -> None:
    query = compile_query(scene, language_space("minilm"), ["armchair", "elephant"])
    camera = scene.camera(0, 56, 42)
    frame = render(scene, camera)
    assert frame.weight_maps is not None
    relevance = relevance_maps(frame.weight_maps, query)
    answered, made = work.Answer(3, View(3, (5, 8), frame, relevance, camera, query, 0)).run(lambda: False)
    assert isinstance(answered, ask.Answered) and isinstance(made, ask.Binned)
    assert [(h.key, h.text) for h in made.histograms] == [(5, "armchair"), (8, "elephant")]
    covered = frame.alphas >= 0.5
    for histogram, values in zip(made.histograms, relevance, strict=True):
        inside = values[covered].tolist()
        assert sum(histogram.counts) == len(inside)
        above = sum(value >= 0.8 for value in inside)
        assert sum(histogram.counts[round(0.8 * BINS) :]) == above
    assert made.histograms[0].counts[-1] > 0 == made.histograms[1].counts[-1]


def surfaces(scene) -> np.ndarray:
    """(3,) opacity times area, each Gaussian of one atom."""
    return np.bincount(scene.semantics.weight_ids[:, 0].numpy(), covered_areas(scene.gaussians))


def test_atoms_are_described(scene) -> None:
    *pictures, found = work.DescribeAtoms(6, scene).run(lambda: False)
    assert [each.key for each in pictures if isinstance(each, do.ShowPicture)] == [
        f"atom {k}" for k in range(3)
    ]
    assert isinstance(found, ask.AtomsDescribed)
    mine = found.insight
    np.testing.assert_allclose(mine.shares, surfaces(scene) / surfaces(scene).sum(), atol=1e-6)
    unit = scene.semantics.dictionary.double().numpy()
    cosines = [[float(a @ b / np.linalg.norm(a) / np.linalg.norm(b)) for b in unit] for a in unit]
    np.testing.assert_allclose(mine.similarity, cosines, atol=1e-12)
    assert sorted(mine.order) == [0, 1, 2] and len(mine.colours) == 3


def test_atoms_are_weighed_by_what_is_left(scene) -> None:
    """Shares of a deleted atom are 0, as if it had never been there."""
    marks = first_marks(scene)
    half = delete(marks, Mask.of(scene.semantics.weight_ids[:, 0].numpy() == 1))
    (found,) = work.WeighAtoms(6, scene, half).run(lambda: False)
    *_, described = work.DescribeAtoms(6, scene, half).run(lambda: False)
    assert isinstance(found, ask.AtomsWeighed) and isinstance(described, ask.AtomsDescribed)
    chair, _, floor = surfaces(scene)
    np.testing.assert_allclose(found.shares, np.array((chair, 0, floor)) / (chair + floor), atol=1e-6)
    assert described.insight.shares == found.shares
    nothing = delete(marks, Mask.full(len(scene.gaussians)))
    (empty,) = work.WeighAtoms(6, scene, nothing).run(lambda: False)
    assert isinstance(empty, ask.AtomsWeighed) and empty.shares == (0.0, 0.0, 0.0)


def test_atoms_without_photos_or_numbers_do_no_harm(scene) -> None:
    broken = scene.semantics.dictionary.clone()
    broken[1] = torch.nan
    poor = replace(
        scene,
        photos=(b"no picture", b""),
        semantics=replace(scene.semantics, dictionary=broken),
    )
    (found,) = work.DescribeAtoms(1, poor).run(lambda: False)  # and no picture
    assert isinstance(found, ask.AtomsDescribed) and np.isfinite(found.insight.similarity).all()
    ids, values = poor.semantics.weight_ids[:, :0], poor.semantics.weight_values[:, :0]
    none = replace(poor, semantics=Semantics(ids, values, broken[:0], poor.semantics.space), photos=())
    (empty,) = work.DescribeAtoms(1, none).run(lambda: False)
    assert isinstance(empty, ask.AtomsDescribed)
    assert (empty.insight.shares, empty.insight.order) == ((), ())


def test_a_scene_that_has_come_has_the_text_model_loaded_before_a_phrase_is_typed(monkeypatch) -> None:
    """What is asked of the worker when a scene arrives reads the text tower; so the first phrase does not."""
    scene = room(language_space("minilm").encode(list(PHRASES)))
    info = describe_scene(scene, serial=1, name="room")
    asked = []
    hands = Hands(print, print, asked.append, lambda: None, lambda: 0.0)
    effects = EditingEffects(hands, Viewport.__new__(Viewport))
    state = after(State(), SceneArrived(info))
    effects.follow(SceneArrived(info), State(), state)
    minilm.load_minilm.cache_clear()
    encode_cached.cache_clear()
    editing_work._household.cache_clear()
    for request in asked:
        list(request.run(lambda: False))
    assert minilm.load_minilm.cache_info().currsize == 1
    monkeypatch.setattr(minilm, "read_minilm", None)
    request = Encode(1, scene, (0,), ("armchair",), (), (b"",), first_marks(scene), 0)
    assert list(request.run(lambda: False))
