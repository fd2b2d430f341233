"""What is trained already: in a run folder, in the weights a run begins with, and out of both as one file."""

import json
from collections.abc import Iterable
from pathlib import Path

import torch

from langflash_core.errors import InputError
from langflash_core.lab.training import second
from langflash_core.lab.training.late import HALVES
from langflash_core.lab.training.real import MODULES
from langflash_core.lab.training.recipes import Recipe, stages_of
from langflash_core.lab.training.stages.language import language_stage
from langflash_core.lab.training.stages.stage import Stage, guided, modules_of
from langflash_core.lab.training.states import load_averaged
from langflash_core.network.build import network_class
from langflash_core.network.checkpoints.files import initial_network, read_weights, save_network, start_from
from langflash_core.network.checkpoints.parts import TRAINED_HERE, fingerprint, write_part
from langflash_core.network.checkpoints.store import network_to_train
from langflash_core.network.model import LangFlashNet
from langflash_core.network.presets import PRESETS

LATE = Stage("late", MODULES, (), {1: 1.0}, 6, 6e-4, language_stage)
"""What `train late` leaves in a run for the stages after it; `real` says how it learns."""
ALL_STAGES = stages_of("mini")
_MODULES = {
    LATE.name: LATE.modules,
    second.NAME: second.MODULES,
    **{name: stage.modules for name, stage in ALL_STAGES.items()},
}
"""Of whatever a run can have trained."""

_UNTRAINED = "holds no trained stage; run `langflash lab train run` first"


def prepared(
    recipe: Recipe, run_dir: Path, start: Path | None, *, from_scratch: bool
) -> tuple[LangFlashNet, dict[str, int]]:
    """The network to train, and the steps of every stage that has weights already."""
    preset, known = PRESETS[recipe.preset], stages_of(recipe.preset)
    if network_class(preset).compact:
        if start is None:
            raise InputError(f"training '{recipe.preset}' begins with a weights file; give one with --start")
        network = initial_network(preset, start, recipe.seed)
        done = load_trained(network, run_dir)
        return network, done if from_scratch else done | dict.fromkeys(begin(network, start, done), 0)
    drawn = {name for plan in recipe.plans for name in plan.stage.modules} if from_scratch else set()
    network, filled = network_to_train(preset, start, recipe.seed, drawn)
    done = {name: 0 for name, stage in known.items() if filled.issuperset(modules_of(network, stage))}
    return network, done | load_trained(network, run_dir)


def load_trained(network: LangFlashNet, run_dir: Path) -> dict[str, int]:
    """Steps of every stage in a run, whose weights the network then has; the late halves, and what
    learned with them, before those that went on."""
    names = (LATE.name, second.NAME, *stages_of(network.preset.name))
    found = {name: load_averaged(network, run_dir, name) for name in names}
    return {name: counts[0] for name, counts in found.items() if counts is not None}


def begin(network: LangFlashNet, start: Path, done: Iterable[str]) -> list[str]:
    """The stages whose modules are trained in a run or could be filled from `start`, but for `done`."""
    done = set(done)
    filled = {module for name in done for module in _MODULES[name]}
    tensors, _ = read_weights(start)
    for name, modules in ((LATE.name, HALVES), (second.NAME, second.MODULES)):
        if name not in done:
            start_from(network, tensors, modules)
    names = [name for name in ALL_STAGES if name not in done]
    return [
        name
        for name in names
        if start_from(network, tensors, [m for m in ALL_STAGES[name].modules if m not in filled])
    ]


def run_export(
    run_dir: Path,
    out: Path,
    start: Path | None,
    *,
    preset: str = "mini",
    metadata: dict | None = None,
    named: float = 1.0,
) -> Path:
    """Join the averaged weights of every stage in `run_dir` into one weights file; stages that
    were not trained there keep the heads of `start`, and are left out where these are imported anyway.

    The header says how long each stage trained, its last validation, and `metadata` (data,
    metrics, calibration: `calibration` is what queries read). named: what corrections of a namer that
    learned in `run_dir` count of what it learned: it knows learned photos by heart, so that less of it names
    others better (MEASURED.md).

    Raises:
        InputError: no stage has been trained.
    """
    if not network_class(PRESETS[preset]).compact:
        return _export_part(run_dir, out, start, preset)
    if start is None:
        raise InputError(f"exporting '{preset}' needs the weights file it began with; give it with --start")
    network = initial_network(PRESETS[preset], start)
    trained = {name: load_averaged(network, run_dir, name) for name in _MODULES}
    begin(network, start, [name for name, counts in trained.items() if counts is not None])
    report = {
        name: {
            "steps": counts[0],
            "hours": round(counts[1] / 3600, 3),
            "validation": last_validation(run_dir, name),
        }
        for name, counts in trained.items()
        if counts is not None
    }
    if not report:
        raise InputError(f"{run_dir} {_UNTRAINED}")
    if trained["naming"] is not None:
        with torch.no_grad():
            for value in guided(network).namer.out.parameters():
                value *= named
    details = dict(metadata or {})
    network.calibration = details.pop("calibration", {})
    save_network(network, out, {"training": report, **details})
    return out


def _export_part(run_dir: Path, out: Path, start: Path | None, preset: str) -> Path:
    """The modules that a run trained, for the geometry and language features that are imported."""
    network, _ = network_to_train(PRESETS[preset], start, 0)
    known = stages_of(preset)
    trained = [name for name in known if load_averaged(network, run_dir, name) is not None]
    if not trained:
        raise InputError(f"{run_dir} {_UNTRAINED}")
    modules = {module for name in trained for module in modules_of(network, known[name])}
    if "decoder" in modules:
        modules.add("encoder")  # a grouping is good for both of them together
    tensors = {
        name: value for name, value in network.state_dict().items() if name.partition(".")[0] in modules
    }
    reads = fingerprint(network.state_dict())
    write_part(
        out, tensors, network.preset, TRAINED_HERE, run_dir.name, side=network.trained_side, reads=reads
    )
    return out


def last_validation(run_dir: Path, stage: str) -> dict:
    """The newest validation row of a stage's log; {} if it has none."""
    path = run_dir / f"{stage}.jsonl"
    if not path.exists():
        return {}
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    kept = [row for row in rows if row["kind"] == "validation"]
    return {k: v for k, v in kept[-1].items() if k not in ("stage", "kind")} if kept else {}
