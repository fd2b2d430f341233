"""Clean-up by rules in the window, against the library's `apply_recipe`; its files, its box, its undo."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.window import commands as do
from app.window.dialogs import Dialog
from app.window.editing import cleaning as clean
from app.window.editing import commands as edit
from app.window.editing.panels.cleaning import edges_seen
from app.window.editing.work import ScoreFloaters
from app.window.scene import commands as show
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.geometry import poses
from langflash_core.language.spaces import language_space
from langflash_core.mending.cleaning import apply_recipe
from langflash_core.mending.recipes import Recipe, load_recipe, parsed_rule
from langflash_core.scene.mask import Mask
from tests.app.window.scenes import PHRASES, after, room

COUNT, BLOCK = 12_300, 2500
RULES = (parsed_rule("depth>1.2,opacity<.95"), parsed_rule("colour~#808080:.2"), parsed_rule("photos<1"))
RECIPES = {
    "rules": Recipe(rules=RULES[:1]),
    "one of several": Recipe(0.4, rules=RULES),
    "the rest": Recipe(0.4, rules=RULES[:1], invert=True),
    "within": Recipe(0.9, rules=RULES[:1], within=("chair",)),
    "core": Recipe(crop="core"),
    "numbers": Recipe(0.2, crop=(-0.4, -0.4, 0.0, 0.5, 0.6, 2.0), kinds=("sheets",)),
}


@pytest.fixture(scope="module")
def info():
    words = language_space("minilm").encode(list(PHRASES))
    return describe_scene(room(words), serial=1, name="room")


@pytest.fixture
def shown(info) -> State:
    return after(State(), show.SceneArrived(info), edit.FindFloaters())


def worked(state: State) -> State:
    """After what the worker finds for the preview."""
    info, marks, preview = state.scene.info, state.editing.marks, state.editing.floaters
    assert info is not None and marks is not None and preview is not None
    return after(state, *ScoreFloaters(1, info.memory, marks, preview.recipe).run(lambda: False))


def going(state: State) -> Mask:
    assert state.editing.floaters is not None and state.editing.marks is not None
    return state.editing.floaters.mask(state.editing.marks.visible)


@pytest.mark.parametrize("recipe", RECIPES.values(), ids=RECIPES)
@pytest.mark.parametrize("selecting", [False, True])
def test_the_preview_is_what_the_command_takes(shown: State, recipe: Recipe, selecting: bool) -> None:
    info = shown.scene.info
    assert info is not None
    within = Mask.first(COUNT, BLOCK) if selecting else None
    if within is not None:
        shown = after(shown, edit.Found(within, "replace", "here"), edit.FindFloaters())
    fields = ("strength", "kinds", "rules", "within", "invert", "crop")
    state = worked(after(shown, clean.ChangeRecipe({name: getattr(recipe, name) for name in fields})))
    wanted = apply_recipe(info.scene, recipe).rows
    if within is not None:  # a box holds everywhere
        boxed = apply_recipe(info.scene, Recipe(crop=recipe.crop)).rows
        wanted = apply_recipe(info.scene, replace(recipe, crop=None)).rows & within.rows() | boxed
    assert np.array_equal(going(state).rows(), wanted)
    assert selecting or 0 < wanted.sum() < COUNT


def test_it_is_one_edit_that_can_be_undone(shown: State) -> None:
    state = worked(after(shown, clean.ChangeRecipe({"crop": "core"})))
    count, before = len(going(state)), state.editing.marks
    gone = after(state, edit.EndFloaters("delete"))
    assert gone.editing.history is not None and gone.editing.num_deleted == count
    assert gone.editing.history.done[-1].label == f"Delete {count:,} by rules"
    assert after(gone, edit.Undo()).editing.marks == before


def test_the_strength_moves_on_what_the_rules_found(shown: State) -> None:
    """Without the worker, so that the preview follows the hand."""
    state = worked(after(shown, clean.ChangeRecipe({"rules": RULES[:1]})))
    moved = after(state, edit.SetStrength(0.0))
    assert moved.scene.info is not None
    wanted = apply_recipe(moved.scene.info.scene, Recipe(0.0, rules=RULES[:1])).rows
    assert np.array_equal(going(moved).rows(), wanted)


def test_what_was_found_for_another_recipe_is_not_shown(shown: State) -> None:
    late = edit.FloatersFound(bytes(4 * COUNT), Recipe(0.5, rules=RULES[:1]), Mask.full(COUNT))
    state = after(shown, clean.ChangeRecipe({"rules": RULES[1:2]}), late)
    assert not going(state)


def test_where_a_recipe_cannot_be_followed_nothing_goes_and_a_sentence_says_why(info, shown: State) -> None:
    blind = describe_scene(replace(info.scene, confidences=None), serial=1, name="room")
    state = after(State(), show.SceneArrived(blind), edit.FindFloaters())
    state = after(state, clean.ChangeRecipe({"rules": (parsed_rule("confidence<.5"),), "invert": True}))
    state = worked(state)
    assert not going(state) and "how sure its depth is" in state.toasts[-1].text
    bad = after(shown, clean.ChangeRecipe({"crop": (1.0, 0.0, 0.0, 0.0, 1.0, 1.0)}))
    assert bad.editing.floaters == shown.editing.floaters and "low corner" in bad.toasts[-1].text


def test_all_of_a_scene_cannot_be_deleted(shown: State) -> None:
    state = worked(after(shown, clean.ChangeRecipe({"crop": (9.0, 9.0, 9.0, 10.0, 10.0, 10.0)})))
    assert len(going(state)) == COUNT
    kept = after(state, edit.EndFloaters("delete"))
    assert not kept.editing.num_deleted and "Nothing would be left" in kept.toasts[-1].text


def test_a_recipe_goes_through_its_file(shown: State, tmp_path: Path) -> None:
    recipe, path = RECIPES["within"], tmp_path / "tidy.recipe.json"
    list(clean.WriteRecipe(recipe, path).run(lambda: False))
    assert load_recipe(path) == recipe, "as langflash clean --recipe reads it"
    state = after(after(shown, edit.EndFloaters()), *clean.ReadRecipe(path).run(lambda: False))
    assert state.editing.floaters is not None and state.editing.floaters.recipe == recipe
    assert state.editing.floaters.open
    asked = after(state, do.ShowDialog(Dialog.SAVE_RECIPE))
    assert asked.typed.text == str(path)


def test_lines_and_rules_are_the_same() -> None:
    for rule in RULES:
        assert clean.rule_of(clean.conditions(rule)) == rule
    both = clean.rule_of([clean.Condition("size", clean.ABOVE, 0.1), clean.Condition("size", clean.BELOW, 1)])
    assert both == {"size": (0.1, 1)} and "size" not in clean.free_names(both)


def test_the_box_is_drawn_as_far_as_it_is_ahead() -> None:
    pose, size = poses.Pose(), (400.0, 300.0)
    around = edges_seen((-9.0, -9.0, -9.0, 9.0, 9.0, 9.0), pose, size)
    assert len(around) == 8, "four edges ahead, and four that go past the camera"
    assert all(np.isfinite(end).all() for edge in around for end in edge)
    centre, forward = np.array(pose.centre), poses.viewmat(pose)[2, :3]
    low = centre - 5 * forward
    assert not edges_seen((*(low - 0.5), *(low + 0.5)), pose, size)
