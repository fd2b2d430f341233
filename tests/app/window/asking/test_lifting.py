"""A splat file that answers no phrases: the offer to teach it, what comes of that, and the way back."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from app.window.asking import lifting
from app.window.asking.effects import AskingEffects
from app.window.asking.panels import prompts
from app.window.commands import ShowPicture
from app.window.editing import commands as edit
from app.window.frame import table
from app.window.kit import theme, widgets
from app.window.requests import Job
from app.window.scene import commands as show
from app.window.scene.effects import SceneEffects
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.errors import Cancelled
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.edits import Marks
from langflash_core.scene.mask import Mask
from langflash_core.types import Scene, Semantics
from tests.app.window import headless
from tests.app.window.desk import Bare, Nothing
from tests.app.window.scenes import room, shown_scene, told


class Desk(Bare):
    """With the effects of scene and asking."""

    def __post_init__(self) -> None:
        super().__post_init__()
        nothing: Any = Nothing()
        scene = SceneEffects(self.hands, nothing, nothing, print)
        self.followers = (scene, AskingEffects(self.hands, nothing))

    def teach(self, cancelled: Callable[[], bool] = lambda: False) -> None:
        """What the worker makes of the one job that was asked for."""
        (job,) = (each for each in self.asked if isinstance(each, Job))
        self.asked.clear()
        self.perform(job.run(7, lambda stage, share: self.perform(show.Progressed(stage, share)), cancelled))


@pytest.fixture
def lifted(monkeypatch) -> list[Scene]:
    """Scenes that were lifted, each by a network that knows three things and sees one."""
    seen = []

    def lift(scene, *, render, progress, cancelled):
        if cancelled():
            raise Cancelled("the lifting was cancelled; nothing was written")
        progress("network", 0.3)
        seen.append(scene)
        count = len(scene.gaussians)
        ids, values = torch.zeros(count, 1, dtype=torch.int64), torch.ones(count, 1)
        return replace(scene, semantics=Semantics(ids, values, torch.eye(3), "minilm"))

    monkeypatch.setattr("langflash_core.lift.lift", lift)
    return seen


@pytest.fixture
def desk() -> Desk:
    desk = Desk()
    plain = bare_scene(room(torch.eye(3)).gaussians, "room.splat")
    desk.perform(show.SceneArrived(describe_scene(plain, 1, "room.splat")))
    desk.asked.clear()
    return desk


def test_a_splat_file_can_learn_and_a_scene_of_photos_need_not(desk: Desk) -> None:
    assert lifting.can_learn(desk.state) and not lifting.can_learn(shown_scene())
    assert not lifting.can_learn(State())
    teach = table.named("Teach this file to answer phrases (lift)")
    assert teach in table.matching("lift", desk.state) and teach in table.matching("teach", desk.state)
    assert teach.make(desk.state) == lifting.TeachPhrases() and teach.make(shown_scene()) is None
    assert desk.state.scene.info is not None
    assert any("cannot answer phrases yet" in said for said in desk.state.scene.info.warnings)


def test_it_is_taught_and_undo_brings_the_file_back(desk: Desk, lifted: list[Scene]) -> None:
    before = desk.state
    desk.perform(lifting.TeachPhrases())
    assert desk.state.scene.job is not None and desk.state.scene.job.title == lifting.TEACHING
    assert not lifting.can_learn(desk.state)
    desk.teach()
    info, scene = desk.state.scene.info, desk.state.scene
    assert info is not None and before.scene.info is not None and len(lifted) == 1
    assert info.num_atoms == 3 and scene.job is None and scene.pose == before.scene.pose
    assert scene.rooms == () and told(desk.state).startswith("It answers phrases now.")
    assert table.named("Undo").make(desk.state) == lifting.ForgetPhrases()
    desk.perform(lifting.ForgetPhrases())
    assert desk.state.scene.info is not None and desk.state.scene.info.scene is before.scene.info.scene
    assert desk.state.scene.mute is None and lifting.can_learn(desk.state)
    assert desk.state.editing.history == before.editing.history


def test_what_was_edited_before_is_taught_as_edited_and_comes_back(desk: Desk, lifted: list[Scene]) -> None:
    desk.perform(edit.Found(Mask.first(12_300, 2500), "replace", "here"), edit.Delete())
    desk.asked.clear()
    desk.perform(lifting.TeachPhrases())
    desk.teach()
    assert desk.state.scene.info is not None and desk.state.editing.history is not None
    assert len(lifted[0].gaussians) == desk.state.scene.info.num_gaussians == 9800
    assert not desk.state.editing.history.done
    desk.perform(lifting.ForgetPhrases())
    assert desk.state.scene.info.num_gaussians == 12_300 and desk.state.editing.num_deleted == 2500
    desk.perform(edit.Undo())
    assert not desk.state.editing.num_deleted


def test_an_edit_meanwhile_leaves_the_scene_as_it_is(desk: Desk, lifted: list[Scene]) -> None:
    desk.perform(lifting.TeachPhrases())
    desk.perform(edit.Found(Mask.first(12_300, 2500), "replace", "here"))
    desk.teach()
    assert desk.state.scene.info is not None and not desk.state.scene.info.num_atoms
    assert desk.state.scene.job is None and "teach it again" in told(desk.state)


def test_it_can_be_cancelled(desk: Desk, lifted: list[Scene]) -> None:
    desk.perform(lifting.TeachPhrases())
    with pytest.raises(Cancelled):
        desk.teach(lambda: True)
    desk.perform(show.JobCancelled())
    assert lifting.can_learn(desk.state) and not lifted


def test_another_scene_forgets_the_way_back(desk: Desk, lifted: list[Scene]) -> None:
    desk.perform(lifting.TeachPhrases())
    desk.teach()
    desk.perform(show.SceneArrived(describe_scene(room(torch.eye(3)), 9, "other")))
    assert desk.state.scene.mute is None


@pytest.mark.parametrize("size", [(900, 560), (1280, 800)])
def test_the_offer_stands_where_phrases_are(desk: Desk, monkeypatch, size: tuple[int, int]) -> None:
    pressed, shown = [], []

    def button(label: str, place: object = None) -> bool:
        shown.append(label)
        return "Teach it" in label and not pressed

    monkeypatch.setattr(widgets, "primary_button", button)
    with headless.context(size):
        theme.set_up(1.0)
        headless.frames(lambda look: pressed.extend(prompts.draw(desk.state, look)), headless.look(), 1)
        assert lifting.TeachPhrases() in pressed and any(lifting.ABOUT in label for label in shown)
        shown.clear()
        headless.frames(lambda look: prompts.draw(shown_scene(), look), headless.look(), 1)
        assert not any("Teach it" in label for label in shown)


def test_what_changes_no_mask_makes_none(monkeypatch):
    """Of 2.6 million Gaussians every command built two masks of what is left: half a second a frame."""
    desk = Desk(shown_scene())
    made = []
    monkeypatch.setattr(Marks, "left", property(lambda marks: made.append(marks) or Mask.none(1)))
    desk.perform(ShowPicture("atom 0", np.zeros((2, 2, 3), np.uint8)))
    assert not made
