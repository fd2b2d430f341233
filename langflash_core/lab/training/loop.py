"""The training loop of one stage: a time budget, warm-up and cosine, EMA, checkpoints, a log.

A run folder holds, per stage, `<stage>.pt` (state to continue from, EMA included) and
`<stage>.jsonl` (one JSON object per report). Later stages read the EMA of earlier ones.
"""

import json
import logging
import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import torch
from torch import Tensor, nn

from langflash_core.lab.training.mixing import loss_of
from langflash_core.lab.training.stages import Stage, Words, modules_of
from langflash_core.network.model import LangFlashNet
from langflash_core.network.precision import mixed

log = logging.getLogger(__name__)

WARM_UP_STEPS = 100
FINAL_SHARE = 0.02
"""Of the peak learning rate, at the end of the budget."""

Validate = Callable[[LangFlashNet], dict[str, float]]


@runtime_checkable
class Drawn(Protocol):
    """What a stage learns from: rooms, photos, both, or parts."""

    def draw(self, count: int, views: int, generator: torch.Generator) -> Any:
        """A batch of the kind that the stage's loss reads, with `seeds` and `to(device)`."""


@dataclass(frozen=True)
class LoopOptions:
    """minutes: training time of this stage, all its resumed parts together; max_steps: stops
    earlier where not None; report_s, validate_s, save_s: seconds between reports."""

    minutes: float
    device: str = "cpu"
    seed: int = 0
    max_steps: int | None = None
    resume: bool = True
    report_s: float = 20.0
    validate_s: float = 300.0
    save_s: float = 120.0
    ema_decay: float = 0.998
    weight_decay: float = 0.01
    pictures: int | None = None
    learning_rate: float | None = None


@dataclass
class LoopState:
    """Where a run stands: steps done, seconds trained, averaged weights by parameter name."""

    step: int = 0
    seconds: float = 0.0
    ema: dict[str, Tensor] = field(default_factory=dict)


def stage_parameters(network: LangFlashNet, stage: Stage) -> dict[str, Tensor]:
    """Every parameter and buffer that the stage owns, by its name in the network."""
    prefixes = tuple(f"{name}." for name in modules_of(network, stage))
    return {k: v for k, v in network.state_dict().items() if k.startswith(prefixes)}


def train_stage(
    network: LangFlashNet,
    stage: Stage,
    rooms: Drawn,
    words: Words,
    run_dir: Path,
    options: LoopOptions,
    validate: Validate | None = None,
) -> LoopState:
    """Train one stage until its budget is spent; the network ends with the averaged weights.

    Raises:
        RuntimeError: the loss stayed non-finite for 20 steps on end.
    """
    network.to(options.device)
    _freeze_all_but(network, stage)
    groups = [
        {"params": list(getattr(network, name).parameters()), "share": stage.rates.get(name, 1.0)}
        for name in modules_of(network, stage)
    ]
    optimiser = torch.optim.AdamW(groups, lr=1e-6, weight_decay=options.weight_decay, betas=(0.9, 0.99))
    state = LoopState(ema={k: v.detach().clone() for k, v in stage_parameters(network, stage).items()})
    path = run_dir / f"{stage.name}.pt"
    if options.resume and path.exists():
        state = _restore(network, stage, optimiser, path)
    run = _Training(network, stage, rooms, words, options, optimiser, state, run_dir, validate)
    run.go()
    network.load_state_dict(state.ema, strict=False)
    return state


def _freeze_all_but(network: LangFlashNet, stage: Stage) -> None:
    network.requires_grad_(False)
    network.eval()
    for name in modules_of(network, stage):
        getattr(network, name).requires_grad_(True).train()
    for parameter in network.parameters():
        if parameter.ndim == 4:  # convolutions are twice as fast on a CPU with channels last
            parameter.data = parameter.data.contiguous(memory_format=torch.channels_last)


@dataclass
class _Training:
    network: LangFlashNet
    stage: Stage
    rooms: Drawn
    words: Words
    options: LoopOptions
    optimiser: torch.optim.Optimizer
    state: LoopState
    run_dir: Path
    validate: Validate | None
    sums: dict[str, float] = field(default_factory=dict)
    counted: int = 0
    bad: int = 0

    def go(self) -> None:
        """Steps, reports, validation and checkpoints until time or steps run out."""
        clock = {"report": 0.0, "validate": 0.0, "save": 0.0}
        marks = dict.fromkeys(clock, self.state.seconds)
        while not self._finished():
            start = time.perf_counter()
            self._step()
            self.state.seconds += time.perf_counter() - start
            if self.state.seconds - marks["report"] >= self.options.report_s:
                marks["report"] = self.state.seconds
                self._report()
            if (
                self.validate is not None
                and self.state.seconds - marks["validate"] >= self.options.validate_s
            ):
                marks["validate"] = self.state.seconds
                self._validate()
            if self.state.seconds - marks["save"] >= self.options.save_s:
                marks["save"] = self.state.seconds
                self._save()
        self._report()
        if self.validate is not None:
            self._validate()
        self._save()

    def _finished(self) -> bool:
        steps = self.options.max_steps
        return self.state.seconds >= 60 * self.options.minutes or (
            steps is not None and self.state.step >= steps
        )

    def _progress(self) -> float:
        by_time = self.state.seconds / (60 * self.options.minutes)
        by_steps = self.state.step / self.options.max_steps if self.options.max_steps else 0.0
        return min(max(by_time, by_steps), 1.0)

    def _step(self) -> None:
        options, stage = self.options, self.stage
        generator = self.words.generator
        sizes, chances = list(stage.views), torch.tensor(list(stage.views.values()))
        views = sizes[int(torch.multinomial(chances, 1, generator=generator))]
        count = max(1, (options.pictures or stage.pictures) // views)
        batch = self.rooms.draw(count, views, generator).to(options.device)
        with mixed(options.device):
            loss = loss_of(stage.loss, self.network, batch, self.words)
        self.optimiser.zero_grad(set_to_none=True)
        if not bool(torch.isfinite(loss.total)):
            self._skip(batch.seeds)
            return
        loss.total.backward()
        trained = [p for group in self.optimiser.param_groups for p in group["params"]]
        norm = nn.utils.clip_grad_norm_(trained, 1.0)
        if not bool(torch.isfinite(norm)):
            self._skip(batch.seeds)
            return
        rate = learning_rate(self.state.step, self._progress(), options.learning_rate or stage.learning_rate)
        for group in self.optimiser.param_groups:
            group["lr"] = rate * group["share"]
        self.optimiser.step()
        self.state.step += 1
        self.bad = 0
        self._average()
        self._count({"loss": float(loss.total.detach()), "norm": float(norm.detach()), **loss.parts})

    def _skip(self, seeds: tuple[int, ...]) -> None:
        self.bad += 1
        log.warning(
            "%s: step %d skipped, loss or gradient not finite (seeds %s)",
            self.stage.name,
            self.state.step,
            seeds,
        )
        if self.bad >= 20:
            raise RuntimeError(
                f"{self.stage.name}: 20 steps on end gave no finite loss; lower the learning rate"
            )

    def _average(self) -> None:
        decay = min(self.options.ema_decay, (1 + self.state.step) / (10 + self.state.step))
        for name, value in stage_parameters(self.network, self.stage).items():
            kept = self.state.ema[name]
            if value.is_floating_point():
                kept.lerp_(value.detach().float().to(kept), 1 - decay)
            else:
                kept.copy_(value)

    def _count(self, parts: dict[str, float]) -> None:
        for key, value in parts.items():
            self.sums[key] = self.sums.get(key, 0.0) + value
        self.counted += 1

    def _report(self) -> None:
        if self.counted:
            means = {k: round(v / self.counted, 5) for k, v in self.sums.items()}
            rate = self.optimiser.param_groups[0]["lr"]
            self._write({"kind": "train", "rate": rate, **means})
        self.sums, self.counted = {}, 0

    def _validate(self) -> None:
        own = {k: v.detach().clone() for k, v in stage_parameters(self.network, self.stage).items()}
        self.network.load_state_dict(self.state.ema, strict=False)
        self.network.eval()
        with torch.inference_mode():
            metrics = self.validate(self.network) if self.validate is not None else {}
        self.network.load_state_dict(own, strict=False)
        for name in modules_of(self.network, self.stage):
            getattr(self.network, name).train()
        self._write({"kind": "validation", **{k: round(v, 5) for k, v in metrics.items()}})

    def _write(self, row: dict) -> None:
        head = {"stage": self.stage.name, "step": self.state.step, "seconds": round(self.state.seconds, 1)}
        log.info("%s", {**head, **row})
        self.run_dir.mkdir(parents=True, exist_ok=True)
        with (self.run_dir / f"{self.stage.name}.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps({**head, **row}) + "\n")

    def _save(self) -> None:
        save_state(
            self.run_dir / f"{self.stage.name}.pt", self.network, self.stage, self.optimiser, self.state
        )


def learning_rate(step: int, progress: float, peak: float) -> float:
    """Linear warm-up over `WARM_UP_STEPS`, then a cosine over the budget down to `FINAL_SHARE`."""
    warm = min(1.0, (step + 1) / WARM_UP_STEPS)
    cosine = FINAL_SHARE + (1 - FINAL_SHARE) * 0.5 * (1 + math.cos(math.pi * progress))
    return peak * warm * cosine


def save_state(
    path: Path, network: LangFlashNet, stage: Stage, optimiser: torch.optim.Optimizer, state: LoopState
) -> None:
    """Everything that continues a stage, written atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".part")
    torch.save(
        {
            "stage": stage.name,
            "weights": stage_parameters(network, stage),
            "ema": state.ema,
            "optimiser": optimiser.state_dict(),
            "step": state.step,
            "seconds": state.seconds,
        },
        temporary,
    )
    os.replace(temporary, path)


def save_cut(path: Path, network: LangFlashNet, stage: Stage, state: LoopState) -> None:
    """What a run left in the network, as the finished stage that `load_averaged` reads; atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_suffix(".part")
    own = {key: value.detach().clone() for key, value in stage_parameters(network, stage).items()}
    torch.save({"stage": stage.name, "ema": own, "step": state.step, "seconds": state.seconds}, temporary)
    os.replace(temporary, path)


def _restore(network: LangFlashNet, stage: Stage, optimiser: torch.optim.Optimizer, path: Path) -> LoopState:
    saved = torch.load(path, map_location="cpu", weights_only=True)
    network.load_state_dict(saved["weights"], strict=False)
    optimiser.load_state_dict(saved["optimiser"])
    log.info("%s: continues at step %d, %.0f s", stage.name, saved["step"], saved["seconds"])
    return LoopState(saved["step"], saved["seconds"], saved["ema"])


def load_averaged(network: LangFlashNet, run_dir: Path, stage_name: str) -> tuple[int, float] | None:
    """Put a stage's averaged weights into the network; (steps, seconds), or None if it has not run."""
    path = run_dir / f"{stage_name}.pt"
    if not path.exists():
        return None
    saved = torch.load(path, map_location="cpu", weights_only=True)
    network.load_state_dict(saved["ema"], strict=False)
    return int(saved["step"]), float(saved["seconds"])
