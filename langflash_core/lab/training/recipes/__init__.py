"""Recipes: stages of training with every number in them, as TOML.

`read_recipe` takes one of those beside this module by name, or a file. Nothing in a recipe is optional that
changes what is learned, so that a file says all of it.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

from langflash_core.errors import InputError
from langflash_core.lab.training.grouping import AggregationWeights, GroupingWeights
from langflash_core.lab.training.loop import LoopOptions, Optimising
from langflash_core.lab.training.naming import NAMING
from langflash_core.lab.training.stages.aggregation import aggregation_stage
from langflash_core.lab.training.stages.grouping import grouping_stage
from langflash_core.lab.training.stages.stage import Stage
from langflash_core.lab.training.stages.table import POINT_STAGES, STAGES
from langflash_core.network.presets import PRECISIONS, PRESETS, PointMaps

_FOLDER = Path(__file__).parent
_TOP = {"preset": str, "seed": int, "precision": str, "ema_decay": float, "optimising": dict, "stages": list}
_STAGE = {
    "name": str, "iterations": int, "learning_rate": float, "views": dict, "photos": float, "pictures": int,
    "batches": int,
}  # fmt: skip
_WEIGHTS = {"grouping": GroupingWeights, "aggregation": AggregationWeights}
_ENDLESS = 1e9  # minutes: iterations alone end a stage, and its rate falls with them


@dataclass(frozen=True)
class StagePlan:
    """A stage, and how long and how it learns."""

    stage: Stage
    options: LoopOptions


@dataclass(frozen=True)
class Recipe:
    """What is trained, in order."""

    preset: str
    plans: tuple[StagePlan, ...]

    @property
    def seed(self) -> int:
        return self.plans[0].options.seed


def stages_of(preset: str) -> dict[str, Stage]:
    """Those that a preset's network has, by name."""
    return dict(POINT_STAGES) if isinstance(PRESETS[preset], PointMaps) else {**STAGES, NAMING.name: NAMING}


def named_recipe(
    stages: Sequence[str],
    minutes: Sequence[float],
    preset: str,
    options: LoopOptions,
    *,
    sam_teacher: bool = False,
) -> Recipe:
    """Stages as they are, each for its minutes.

    Args:
        sam_teacher: the grouping also regresses SAM's dense embedding.

    Raises:
        InputError: an unknown stage, or not as many minutes as stages.
    """
    if len(stages) != len(minutes):
        raise InputError(
            f"{len(stages)} stages need as many minutes, received {len(minutes)}; give one number per stage"
        )
    known = stages_of(preset)
    if sam_teacher:
        known["grouping"] = weighted(known["grouping"], GroupingWeights(teacher=1.0))
    for name in stages:
        if name not in known:
            raise InputError(f"there is no stage '{name}'; choose among {', '.join(known)}")
    budgets = zip(stages, minutes, strict=True)
    plans = tuple(StagePlan(known[name], replace(options, minutes=budget)) for name, budget in budgets)
    return Recipe(preset, plans)


def recipe_names() -> list[str]:
    """Those that come with the program."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml"))


def read_recipe(name: str, options: LoopOptions) -> Recipe:
    """A recipe by its name, or that of a file.

    Args:
        options: of the machine: device, when to report; `max_steps` shortens every
            stage. What the recipe says goes before them.

    Raises:
        InputError: there is none, or it does not say everything, or something that nobody knows.
    """
    path = _FOLDER / f"{name}.toml" if name in recipe_names() else Path(name)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError:
        known = ", ".join(recipe_names())
        raise InputError(f"there is no recipe '{name}'; choose {known}, or the path of a .toml") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
        raise InputError(f"{path} is not TOML ({problem}); see the recipe 'paper' for one that is") from None
    _check(table, _TOP, str(path))
    if table["preset"] not in PRESETS or not table["stages"]:
        raise InputError(f"{path}: preset must be one of {', '.join(PRESETS)}, with one stage or more")
    if table["precision"] not in PRECISIONS:
        raise InputError(f"{path}: precision must be one of {', '.join(PRECISIONS)}")
    common = replace(
        options, minutes=_ENDLESS, seed=table["seed"], precision=table["precision"],
        ema_decay=float(table["ema_decay"]), optimising=_optimising(table["optimising"], path),
    )  # fmt: skip
    plans = tuple(_plan(entry, table["preset"], common, path) for entry in table["stages"])
    return Recipe(table["preset"], plans)


def _plan(entry: Any, preset: str, common: LoopOptions, path: Path) -> StagePlan:
    known = stages_of(preset)
    if not isinstance(entry, dict) or entry.get("name") not in known:
        raise InputError(f"{path}: a stage of '{preset}' is named one of {', '.join(known)}")
    where = f"{path}, stage {entry['name']}"
    weights = _WEIGHTS.get(entry["name"])
    _check(entry, _STAGE | ({} if weights is None else {"weights": dict}), where)
    views = {int(count): float(chance) for count, chance in entry["views"].items() if str(count).isdigit()}
    numbers = (entry["iterations"], entry["learning_rate"], entry["pictures"], entry["batches"])
    if len(views) != len(entry["views"]) or not views or min(*numbers, *views, *views.values()) <= 0:
        raise InputError(f"{where}: views, iterations, rate, pictures and batches are numbers above 0")
    if not 0 <= entry["photos"] <= 1:
        raise InputError(f"{where}: photos is a share of the pictures, 0 to 1, received {entry['photos']}")
    stage = known[entry["name"]]
    if weights is not None:
        _check(entry["weights"], {field.name: float for field in fields(weights)}, f"{where}, weights")
        stage = weighted(stage, weights(**entry["weights"]))
    stage = replace(
        stage, views=views, learning_rate=float(entry["learning_rate"]), photos=float(entry["photos"])
    )
    steps = min(entry["iterations"], common.max_steps or entry["iterations"])
    own = replace(common, max_steps=steps, pictures=entry["pictures"], batches=entry["batches"])
    return StagePlan(stage, own)


def weighted(stage: Stage, weights: GroupingWeights | AggregationWeights) -> Stage:
    """A stage whose loss has these weights."""
    if isinstance(weights, GroupingWeights):
        return replace(stage, loss=partial(grouping_stage, weights=weights), dense=weights.teacher > 0)
    return replace(stage, loss=partial(aggregation_stage, weights=weights))


def _optimising(table: dict[str, Any], path: Path) -> Optimising:
    kinds = {field.name: list if field.name == "betas" else float for field in fields(Optimising)}
    _check(table, kinds, f"{path}, optimising")
    betas = table["betas"]
    if len(betas) != 2 or not all(isinstance(beta, float) and 0 <= beta < 1 for beta in betas):
        raise InputError(f"{path}, optimising: betas are two numbers from 0 to 1")
    if table["warm_up"] < 1 or table["clip"] <= 0 or table["weight_decay"] < 0:
        raise InputError(f"{path}, optimising: warm_up and clip are above 0, weight_decay is not below 0")
    if not 0 <= table["final_share"] <= 1:
        raise InputError(f"{path}, optimising: final_share is a share, 0 to 1, of the rate")
    return Optimising(**{**table, "betas": (betas[0], betas[1]), "warm_up": int(table["warm_up"])})


def _check(table: dict[str, Any], kinds: Mapping[str, type], where: str) -> None:
    """Exactly these entries, of these kinds; a whole number passes for any."""
    for problem, names in (("lacks", kinds.keys() - table), ("knows no", table.keys() - kinds.keys())):
        if names:
            raise InputError(f"{where} {problem} {', '.join(sorted(names))}; see the recipe 'paper'")
    for name, kind in kinds.items():
        value = table[name]
        right = isinstance(value, int | float if kind is float else kind) and not isinstance(value, bool)
        if not right:
            raise InputError(f"{where}: {name} must be a {_WORDS[kind]}, received {value!r}")


_WORDS = {str: "word", int: "whole number", float: "number", dict: "table", list: "list"}
