"""No command takes away what a person did: each can be undone, bit for bit, or changes no edit at all."""

import sys
import typing
from dataclasses import fields, is_dataclass, replace
from datetime import datetime
from enum import Enum
from pathlib import Path
from types import NoneType, UnionType

import numpy as np
import pytest
import torch
from torch import Tensor

from app.gl.scene import Thinned
from app.window import commands as do
from app.window.asking import commands as ask
from app.window.commands import apply
from app.window.editing import commands as edit
from app.window.editing import placing
from app.window.editing import pointing as point
from app.window.editing.state import Reading, Region
from app.window.editing.work import ScoreFloaters, request_for
from app.window.exporting import commands as export
from app.window.filming import commands as film
from app.window.opening import commands as opening
from app.window.recovery import commands as keep
from app.window.recovery.state import Kept
from app.window.scene import camera
from app.window.scene import commands as show
from app.window.scene.state import SceneInfo
from app.window.scene.work import describe_scene
from app.window.state import State
from langflash_core.base.outputs import OFFERED, Output
from langflash_core.base.pictures import PICTURES, Picture
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.language.relevance import CompiledQuery, compile_query
from langflash_core.language.spaces import language_space
from langflash_core.mending.recipes import Recipe
from langflash_core.scene.edited import edited_scene
from langflash_core.scene.edits import Marks, Mask
from langflash_core.types import Scene
from tests.app.window.scenes import PHRASES, room

MODULES = (do, show, camera, ask, edit, placing, point, export, keep, film, opening)
ARRIVES = show.SceneArrived  # another scene; the edits of the one before are kept on the disk
SAYS_WHICH = {
    "combine": ("replace", "add", "remove"),
    "kind": ("info", "error"),
    "then": ("", "delete", "select"),
}
GIVEN = {
    ("mode", str): "rgb",
    ("pair", tuple[int, int] | None): None,
    ("name", tuple): ("a view",),
}  # what else would be no answer
TABLES = {Picture: PICTURES, Output: OFFERED}
LAZY = {  # known to the type checker alone
    **{each.__name__: each for each in (CompiledQuery, Scene, Tensor)},
    "Fewer": Thinned,
}
SIZE = (64, 48)  # pixels of the picture that regions are drawn on


def command_classes() -> list[type]:
    return [
        cls
        for module in MODULES
        for cls in vars(module).values()
        if isinstance(cls, type)
        and cls.__module__ == module.__name__
        and is_dataclass(cls)
        and cls is not ARRIVES
    ]


@pytest.fixture(scope="module")
def shown() -> State:
    info = describe_scene(room(language_space("minilm").encode(list(PHRASES))), serial=1, name="room")
    state = apply(State(), show.SceneArrived(info))
    for key, phrase in enumerate(PHRASES):
        state = apply(apply(state, ask.AddPrompt()), ask.EditPrompt(key, phrase))
    return state


@pytest.fixture(scope="module")
def edited(shown: State) -> State:
    """With something deleted, hidden, selected, named and merged, and something to redo."""
    rows = np.arange(12_300)
    for command in (
        edit.Found(Mask.of(rows % 7 == 0), "replace", "here"), edit.Delete(),
        edit.Found(Mask.of(rows % 5 == 0), "replace", "here"), edit.Hide(),
        film.AddKey(), edit.RenameAtom(1, "my wall"), edit.MergeAtoms((0, 2)), edit.ToggleAtom(1),
        edit.Found(Mask.of(rows % 3 == 0), "replace", "here"), edit.Invert(), edit.Undo(),
        edit.FindFloaters(), edit.FloatersFound(np.linspace(0, 6, 12_300, dtype=np.float32).tobytes()),
    ):  # fmt: skip
        shown = apply(shown, command)
    return shown


def arguments(cls: type, chance: np.random.Generator, state: State) -> dict:
    hints = typing.get_type_hints(cls, {**vars(sys.modules[cls.__module__]), **LAZY})
    return {f.name: value(f.name, hints[f.name], chance, state) for f in fields(cls)}


def value(name: str, hint, chance: np.random.Generator, state: State):
    """Something of a type that a command may be given."""
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if (name, hint) in GIVEN:
        return GIVEN[name, hint]
    if name in SAYS_WHICH:
        return SAYS_WHICH[name][chance.integers(len(SAYS_WHICH[name]))]
    if origin in (typing.Union, UnionType):
        return value(name, parts[chance.integers(len(parts))], chance, state)
    if origin is tuple:
        if parts[-1] is Ellipsis:
            return tuple(value("", parts[0], chance, state) for _ in range(chance.integers(4)))
        return tuple(value("", part, chance, state) for part in parts)
    if hint in MADE:
        return MADE[hint](chance, state)
    if isinstance(hint, type) and (hint in TABLES or issubclass(hint, Enum)):
        choices = list(TABLES.get(hint, hint))
        return choices[chance.integers(len(choices))]
    if is_dataclass(hint) and isinstance(hint, type):
        return hint(**arguments(hint, chance, state))
    raise TypeError(f"a command takes {hint}: say here how to make one")


def scene_of(state: State) -> Scene:
    """The scene on show."""
    assert state.scene.info is not None
    return state.scene.info.scene


MADE: dict = {
    NoneType: lambda chance, state: None,
    Mask: lambda chance, state: Mask.of(chance.random(12_300) < 0.3),
    Marks: lambda chance, state: state.editing.marks,
    CompiledQuery: lambda chance, state: compile_query(scene_of(state), language_space("minilm"), ["wall"]),
    Scene: lambda chance, state: scene_of(state),
    Thinned: lambda chance, state: Thinned(scene_of(state), np.arange(2)),
    do.Command: lambda chance, state: show.ClearPhotos(),
    SceneInfo: lambda chance, state: state.scene.info,
    Pose: lambda chance, state: state.scene.pose,
    Vector: lambda chance, state: Vector(*chance.normal(size=3).tolist()),
    Kept: lambda chance, state: replace(
        keep.kept_session(state, Path("/nowhere/a.langflash")), photos=("a.png", "b.png"), fovs=(None, 60.0)
    ),
    Recipe: lambda chance, state: Recipe(strength=float(chance.random())),
    bool: lambda chance, state: bool(chance.integers(2)),
    int: lambda chance, state: int(chance.integers(-1, 5)),
    float: lambda chance, state: float(chance.normal()),
    str: lambda chance, state: ("", "wall", "an armchair")[chance.integers(3)],
    bytes: lambda chance, state: chance.random(12_300, np.float32).tobytes(),
    np.ndarray: lambda chance, state: np.eye(3),
    Tensor: lambda chance, state: torch.rand(1, 4, 4),
    datetime: lambda chance, state: datetime(2026, 1, 1),
    Path: lambda chance, state: Path(f"/nowhere/{chance.integers(5)}.langflash"),
}


def bits(state: State) -> tuple:
    """All that edits hold."""
    marks = state.editing.marks
    assert marks is not None
    masks = marks.deleted.bits, marks.hidden.bits, marks.selected.bits
    return *masks, marks.atoms, state.keys, state.metric, marks.changes, marks.there


@pytest.mark.parametrize("cls", command_classes(), ids=lambda cls: cls.__name__)
def test_a_command_can_be_undone_or_changes_no_edit(cls: type, edited: State) -> None:
    chance = np.random.default_rng(11)
    before, history = bits(edited), edited.editing.history
    assert history is not None
    for _ in range(8):
        after = apply(edited, cls(**arguments(cls, chance, edited)))
        now = after.editing.history
        assert now is not None and after.scene.info is not None and edited.scene.info is not None
        assert after.scene.info.scene is edited.scene.info.scene  # the scene itself never changes
        if now == history:
            continue
        there = apply(after, edit.GoTo(len(history.done)))
        assert bits(there) == before
        # Nothing that was done is gone: the entries before are still there, done or to redo.
        assert (
            now.done[: len(history.done)] == history.done
            or now.undone[: len(history.undone)] == history.undone
        )


def answered(state: State, command: do.Command) -> State:
    """A command, and what the worker finds for it."""
    after = apply(state, command)
    info, marks = after.scene.info, after.editing.marks
    assert info is not None and marks is not None
    request = request_for(command, after, info, marks, SIZE)
    if isinstance(command, edit.FindFloaters):
        request = ScoreFloaters(info.serial, info.memory, marks)
    for found in () if request is None else request.run(lambda: False):
        after = apply(after, found)
    return after


def random_command(chance: np.random.Generator, state: State) -> do.Command:
    """Something that a person does while editing."""
    combine = SAYS_WHICH["combine"][chance.integers(3)]
    points = tuple((float(x), float(y)) for x, y in chance.uniform((0, 0), SIZE, (2, 2)))
    atom, key = int(chance.integers(3)), int(chance.integers(3))
    choices: tuple[do.Command, ...] = (
        edit.SelectRegion(Region(points), combine), edit.SelectRegion(Region(points, 6.0), combine),
        edit.SelectRegion(Region(points[:1], 4.0), combine), edit.SelectByPhrase(key, combine),
        edit.SelectAtom(atom, combine), edit.Grow(), edit.Grow(phrase=True), edit.Invert(), edit.SelectAll(),
        edit.Deselect(), edit.Delete(), edit.Hide(), edit.Isolate(), edit.ShowAll(), edit.FindFloaters(),
        edit.SetStrength(float(chance.uniform(0, 1))), edit.EndFloaters("select"),
        edit.EndFloaters("delete"), point.SetThrough(bool(chance.integers(2))),
        edit.RenameAtom(atom, f"thing {key}"), edit.ToggleAtom(atom), edit.MergeAtoms((atom, key)),
        film.AddKey(), film.RemoveKey(key), film.ClearKeys(), point.SetLength(float(chance.uniform(0.1, 2))),
        placing.Nudge(*chance.uniform(-1, 1, 3).tolist()), placing.BeginTint(),
        edit.Undo(), edit.Redo(), edit.GoTo(int(chance.integers(0, 200))),
    )  # fmt: skip
    command = placing.EndGesture() if state.editing.gesture else choices[chance.integers(len(choices))]
    if isinstance(command, edit.GoTo) and chance.random() < 0.9:
        return edit.Redo()  # rarely: it may take all of them back
    if isinstance(command, edit.Delete) and state.editing.num_selected > 600:
        return edit.Hide()  # deleting everything early would leave nothing to edit
    return command


def test_200_random_edits_undone_give_the_first_state_bit_for_bit(shown: State) -> None:
    chance = np.random.default_rng(3)
    state, names = shown, set()
    for end in ((0.0, 0.0, 1.0), (0.5, 0.0, 1.0)):
        state = apply(state, point.RulerPlaced(Reading((1.0, 1.0), end)))
    while len(state.editing.history.done) < 200:  # type: ignore[union-attr]
        command = random_command(chance, state)
        after = answered(state, command)
        if after.editing.history != state.editing.history:
            names.add(type(command).__name__)
        state = after
    assert names >= {
        "SelectRegion", "SelectByPhrase", "SelectAtom", "Grow", "Invert", "SelectAll", "Deselect", "Delete",
        "Hide", "Isolate", "ShowAll", "EndFloaters", "RenameAtom", "ToggleAtom", "MergeAtoms", "AddKey",
        "RemoveKey", "ClearKeys", "SetLength", "Undo", "Redo", "Nudge", "EndGesture",
    }  # fmt: skip
    last, scene = bits(state), shown.scene.info.scene  # type: ignore[union-attr]
    assert last != bits(shown)
    back = state
    for _ in range(200):
        back = apply(back, edit.Undo())
    assert bits(back) == bits(shown) and back.editing.history.done == ()  # type: ignore[union-attr]
    assert replace(back.editing.history, undone=()) == shown.editing.history  # type: ignore[type-var]
    for name, tensor in vars(edited_scene(scene, back.editing.marks).gaussians).items():  # type: ignore[arg-type]
        assert torch.equal(tensor, getattr(scene.gaussians, name)), name
    for _ in range(200):
        back = apply(back, edit.Redo())
    assert bits(back) == last
