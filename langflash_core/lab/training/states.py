"""Where a run stands, on disk: what a stage goes on from, and what later stages read of it."""

import json
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from langflash_core.base.files import write_atomically
from langflash_core.errors import InputError
from langflash_core.lab.saving import save_whole
from langflash_core.lab.training.ranks import leads
from langflash_core.lab.training.stages.stage import Stage, modules_of
from langflash_core.network.checkpoints.files import with_deep
from langflash_core.network.model import LangFlashNet

log = logging.getLogger(__name__)


@dataclass
class LoopState:
    """Where a run stands: steps done, steps begun (some were skipped), seconds trained, averaged weights by
    parameter name."""

    step: int = 0
    seconds: float = 0.0
    ema: dict[str, Tensor] = field(default_factory=dict)
    begun: int = 0


def stage_parameters(network: LangFlashNet, stage: Stage) -> dict[str, Tensor]:
    """Every parameter and buffer that the stage owns, by its name in the network."""
    prefixes = tuple(f"{name}." for name in modules_of(network, stage))
    return {k: v for k, v in network.state_dict().items() if k.startswith(prefixes)}


def save_state(
    path: Path,
    network: LangFlashNet,
    stage: Stage,
    optimiser: torch.optim.Optimizer,
    state: LoopState,
    draws: list[dict[str, Tensor]],
) -> None:
    """Everything that continues a stage, written atomically by the process that leads.

    Args:
        draws: of all batches of a step (`draws.all_states`).
    """
    _write(
        path,
        {
            "stage": stage.name,
            "weights": stage_parameters(network, stage),
            "ema": state.ema,
            "optimiser": optimiser.state_dict(),
            "step": state.step,
            "begun": state.begun,
            "seconds": state.seconds,
            "draws": draws,
        },
    )


def save_cut(path: Path, network: LangFlashNet, stage: Stage, state: LoopState) -> None:
    """What a run left in the network, as the finished stage that `load_averaged` reads; atomically."""
    own = {key: value.detach().clone() for key, value in stage_parameters(network, stage).items()}
    _write(path, {"stage": stage.name, "ema": own, "step": state.step, "seconds": state.seconds})


def _write(path: Path, content: Mapping[str, Any]) -> None:
    if leads():
        save_whole(dict(content), path)


def restore_state(
    network: LangFlashNet, stage: Stage, optimiser: torch.optim.Optimizer, path: Path
) -> tuple[LoopState, list[dict[str, Tensor]]]:
    """Where a run stands, and what it drew; [] of runs that did not keep that.

    Raises:
        InputError: other parts learned in it, as in runs from before depth had a late half of its own.
    """
    saved = torch.load(path, map_location="cpu", weights_only=True)
    if saved["weights"].keys() != stage_parameters(network, stage).keys():
        raise InputError(f"{path} holds a network of other parts, which cannot go on; name another folder")
    network.load_state_dict(saved["weights"], strict=False)
    optimiser.load_state_dict(saved["optimiser"])
    log.info("%s: continues at step %d, %.0f s", stage.name, saved["step"], saved["seconds"])
    begun = saved.get("begun", saved["step"])
    own = stage_parameters(network, stage)
    ema = {name: value.to(own[name].device) for name, value in saved["ema"].items()}
    return LoopState(saved["step"], saved["seconds"], ema, begun), saved.get("draws", [])


def forget_later_rows(path: Path, step: int) -> None:
    """Take the rows of a log away that a run wrote after it was last saved: they come again."""
    if not leads() or not path.exists():
        return
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    kept = [line for line in lines if line.endswith("\n") and json.loads(line)["step"] <= step]
    if len(kept) < len(lines):
        write_atomically(path, "".join(kept).encode())


def load_averaged(network: LangFlashNet, run_dir: Path, stage_name: str) -> tuple[int, float] | None:
    """Put a stage's averaged weights into the network; (steps, seconds), or None if it has not run."""
    path = run_dir / f"{stage_name}.pt"
    if not path.exists():
        return None
    saved = torch.load(path, map_location="cpu", weights_only=True)
    network.load_state_dict(with_deep(saved["ema"]), strict=False)
    return int(saved["step"]), float(saved["seconds"])
