"""What can happen to the recipe of the clean-up that is previewed, and its files."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from langflash_core.errors import InputError
from langflash_core.mending.recipes import COLOUR, MEASURES, Recipe, Rule, load_recipe, save_recipe

from ..commands import Command, Notify
from ..requests import Asked, Task
from ..state import State
from .commands import FindFloaters

BELOW, ABOVE = 1, 0
"""Which bound of a measure a condition sets: its place in a rule's pair."""
FIRST = {
    "confidence": (BELOW, 0.2), "size": (ABOVE, 0.1), "opacity": (BELOW, 0.1), "depth": (ABOVE, 5.0),
    "photos": (BELOW, 2.0),
}  # fmt: skip
"""What a new condition says."""
FIRST_COLOUR = (0.5, 0.5, 0.5, 0.1)


@dataclass(frozen=True)
class Condition:
    """One line of a rule. side: BELOW or ABOVE. value: of a measure. shade: of a colour, with how far off."""

    name: str
    side: int = BELOW
    value: float = 0.0
    shade: tuple[float, ...] = ()


def conditions(rule: Rule) -> tuple[Condition, ...]:
    """A rule line by line; `rule_of` makes it of them again."""
    lines = []
    for name, limits in rule.items():
        if name == COLOUR:
            lines.append(Condition(name, shade=tuple(float(v or 0) for v in limits)))
            continue
        bounds = enumerate(limits)
        lines += [Condition(name, side, value) for side, value in bounds if value is not None]
    return tuple(lines)


def rule_of(lines: Sequence[Condition]) -> Rule:
    """Lines as one rule; of two that set the same bound the last one holds."""
    rule: dict[str, tuple[float | None, ...]] = {}
    for line in lines:
        if line.name == COLOUR:
            rule[COLOUR] = line.shade
            continue
        low, high = rule.get(line.name, (None, None))
        rule[line.name] = (line.value, high) if line.side == ABOVE else (low, line.value)
    return rule


def first_of(name: str) -> Condition:
    """A new condition on a measure or on colour."""
    return Condition(name, shade=FIRST_COLOUR) if name == COLOUR else Condition(name, *FIRST[name])


def free_names(rule: Rule) -> tuple[str, ...]:
    """What a rule says nothing about yet."""
    return tuple(name for name in (*MEASURES, COLOUR) if name not in rule)


def as_sentence(problem: Exception) -> str:
    """An error for people."""
    said = str(problem)
    return f"{said[:1].upper()}{said[1:]}."


@dataclass(frozen=True)
class ShowRules:
    """The rules of the clean-up beside its strength, or no longer; begins a preview where there is none."""

    open: bool = True

    def apply(self, state: State) -> State:
        state = state if state.editing.floaters else FindFloaters().apply(state)
        preview = state.editing.floaters
        return state if preview is None else state.with_editing(floaters=replace(preview, open=self.open))


@dataclass(frozen=True)
class ChangeRecipe:
    """Other fields of the previewed recipe; one that cannot be is told in a sentence."""

    changes: Mapping[str, Any] = field(hash=False)

    def apply(self, state: State) -> State:
        preview = state.editing.floaters
        if preview is None:
            return state
        try:
            recipe = replace(preview.recipe, **self.changes)
        except InputError as problem:
            return Notify(as_sentence(problem)).apply(state)
        return state.with_editing(floaters=replace(preview, recipe=recipe))


@dataclass(frozen=True)
class SaveRecipe:
    """Write the previewed recipe to `path` (the worker does)."""

    path: Path

    def apply(self, state: State) -> State:
        return replace(state.with_editing(recipe_path=self.path), dialog=None)


@dataclass(frozen=True)
class LoadRecipe:
    """Read a recipe from `path` (the worker does)."""

    path: Path

    def apply(self, state: State) -> State:
        return replace(state, dialog=None)


@dataclass(frozen=True)
class RecipeRead:
    """A recipe out of a file is previewed, with its rules."""

    path: Path
    recipe: Recipe

    def apply(self, state: State) -> State:
        state = ShowRules().apply(state)
        preview = state.editing.floaters
        if preview is None:
            return state
        shown = replace(preview, recipe=self.recipe)
        return state.with_editing(floaters=shown, recipe_path=self.path)


@dataclass(frozen=True)
class WriteRecipe(Task):
    """Write a recipe, as `langflash clean --save-recipe` does."""

    saves = True

    recipe: Recipe
    path: Path

    def run(self, stopping: Asked) -> Iterator[Command]:
        save_recipe(self.recipe, self.path)
        yield Notify(f"Saved {self.path}", "info")


@dataclass(frozen=True)
class ReadRecipe(Task):
    """Read a recipe."""

    path: Path

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield RecipeRead(self.path, load_recipe(self.path))
