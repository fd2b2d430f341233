"""The training loop of one stage: a budget, warm-up and cosine, EMA, checkpoints, a log.

A run folder holds, per stage, `<stage>.pt` (state to continue from, EMA included) and
`<stage>.jsonl` (one JSON object per report). Later stages read the EMA of earlier ones.

A step is made of one or more batches whose gradients are averaged, by this process (accumulation) or by
several (torchrun, DistributedDataParallel): the same numbers either way, but for rounding.
"""

import json
import logging
import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import torch
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from langflash_core.lab.training.ahead import DrawnAhead
from langflash_core.lab.training.board import Board
from langflash_core.lab.training.draws import Draws, all_states, begin_draws, restore_draws
from langflash_core.lab.training.mixing import loss_of
from langflash_core.lab.training.ranks import agreed, everywhere, gathered, leads, world
from langflash_core.lab.training.stages.stage import Stage, Words, modules_of
from langflash_core.lab.training.states import (
    LoopState,
    forget_later_rows,
    restore_state,
    save_state,
    stage_parameters,
)
from langflash_core.network.model import LangFlashNet
from langflash_core.network.precision import mixed_precision

log = logging.getLogger(__name__)

MAX_BAD = 20
"""Steps on end without a finite loss; then a run gives up."""

Validate = Callable[[LangFlashNet], dict[str, float]]


@runtime_checkable
class Drawn(Protocol):
    """What a stage learns from: rooms, photos, both, or parts."""

    def draw(self, count: int, views: int, generator: torch.Generator) -> Any:
        """A batch of the kind that the stage's loss reads, with `seeds` and `to(device)`."""


@dataclass(frozen=True)
class Optimising:
    """AdamW and what surrounds it. clip: norm that gradients are cut to; warm_up: steps; final_share: of the
    peak rate, at the end of the budget."""

    weight_decay: float = 0.01
    betas: tuple[float, float] = (0.9, 0.99)
    clip: float = 1.0
    warm_up: int = 100
    final_share: float = 0.02


@dataclass(frozen=True)
class LoopOptions:
    """minutes: training time of this stage, all its resumed parts together; max_steps: stops
    earlier where not None; report_s, validate_s, save_s: seconds between reports.

    pictures: of a batch; batches: that a step is made of, None for one a process; precision: auto, float32
    or bfloat16; board: also write TensorBoard's logs; workers: processes that draw batches ahead, 0: none.
    """

    minutes: float
    device: str = "cpu"
    seed: int = 0
    max_steps: int | None = None
    report_s: float = 20.0
    validate_s: float = 300.0
    save_s: float = 120.0
    pictures: int | None = None
    learning_rate: float | None = None
    ema_decay: float = 0.998
    batches: int | None = None
    precision: str = "auto"
    board: bool = False
    workers: int = 0
    optimising: Optimising = Optimising()

    def computing(self) -> torch.autocast:
        """A context in which losses are computed in the precision asked for."""
        if self.precision == "auto":
            return mixed_precision(self.device)
        kind, half = torch.device(self.device).type, self.precision == "bfloat16"
        return torch.autocast(kind, torch.bfloat16, enabled=half)


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
        RuntimeError: the loss stayed non-finite for 20 steps on end; names the batches.
        InputError: the batches of a step cannot be shared by the processes.
    """
    network.to(options.device)
    _freeze_all_but(network, stage)
    groups = [
        {"params": list(getattr(network, name).parameters()), "share": stage.rates.get(name, 1.0)}
        for name in modules_of(network, stage)
    ]
    rule = options.optimising
    optimiser = torch.optim.AdamW(groups, lr=1e-6, weight_decay=rule.weight_decay, betas=rule.betas)
    state = LoopState(ema={k: v.detach().clone() for k, v in stage_parameters(network, stage).items()})
    draws = begin_draws(words, options.batches, options.seed)
    path = run_dir / f"{stage.name}.pt"
    if path.exists():
        state, drawn = restore_state(network, stage, optimiser, path)
        if drawn:
            restore_draws(draws, drawn)
        forget_later_rows(path.with_suffix(".jsonl"), state.step)
    with Board(run_dir / "board" / stage.name, wanted=options.board and leads()) as board:
        run = _Training(network, stage, rooms, draws, options, optimiser, state, run_dir, validate, board)
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


class _StageLoss(nn.Module):
    """A stage's loss as a module: what DistributedDataParallel can watch. parts: of the last call."""

    def __init__(self, network: LangFlashNet, stage: Stage):
        super().__init__()
        self.network, self.stage = network, stage
        self.parts: dict[str, float] = {}

    def forward(self, batch: Any, words: Words) -> Tensor:
        loss = loss_of(self.stage.loss, self.network, batch, words)
        self.parts = loss.parts
        return loss.total


@dataclass
class _Training:
    network: LangFlashNet
    stage: Stage
    rooms: Drawn
    draws: list[Draws]
    options: LoopOptions
    optimiser: torch.optim.Optimizer
    state: LoopState
    run_dir: Path
    validate: Validate | None
    board: Board
    sums: dict[str, float] = field(default_factory=dict)
    counted: int = 0
    bad: int = 0
    spent: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.inner = _StageLoss(self.network, self.stage)
        self.loss: nn.Module = self.inner
        batches = len(self.draws) * world()
        self.sets = {draws.number: self._set(draws.number, batches) for draws in self.draws}
        if world() > 1:
            self.loss = DistributedDataParallel(
                self.inner, find_unused_parameters=True, forward_sync_buffers=False
            )

    def _set(self, number: int, batches: int) -> Drawn:
        part, options = _part(self.rooms, number, batches), self.options
        if not options.workers:
            return part
        return DrawnAhead(part, options.workers, options.seed + 1_000_003 * number, self._sized)

    def go(self) -> None:
        """Steps, reports, validation and checkpoints until time or steps run out."""
        clock = {"report": 0.0, "validate": 0.0, "save": 0.0}
        marks = dict.fromkeys(clock, self.state.seconds)
        while not self._finished():
            start = time.perf_counter()
            self._step()
            self.state.seconds += time.perf_counter() - start
            self.state.seconds = agreed(self.state.seconds, self.options.device)
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
        if "update" in self.spent:
            self._write({"kind": "profile", **{k: round(v, 3) for k, v in self.spent.items()}})

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
        self.optimiser.zero_grad(set_to_none=True)
        self.state.begun += 1
        told: list[dict[str, float]] = []
        seeds: list[Any] = []
        for draws in self.draws:
            with draws.drawing() as words:
                with self._spending("reading"):
                    batch = self._draw(draws, words.generator)
                seeds.append(batch.seeds)
                with self._spending("forward"), self.options.computing():
                    total = self.loss(batch, words)
                    good = bool(torch.isfinite(total))
            if not everywhere(good, self.options.device):
                self._skip(seeds[-1], good)
                return
            with self._spending("backward"):  # averages over processes each time, which adds up to the same
                (total / len(self.draws)).backward()
            told.append({"loss": float(total.detach()), **self.inner.parts})
        with self._spending("update"):
            self._update(told, seeds)

    def _sized(self, generator: torch.Generator) -> tuple[int, int]:
        """Scenes of a batch, and views of each."""
        sizes, chances = list(self.stage.views), torch.tensor(list(self.stage.views.values()))
        views = sizes[int(torch.multinomial(chances, 1, generator=generator))]
        return max(1, (self.options.pictures or self.stage.pictures) // views), views

    def _draw(self, draws: Draws, generator: torch.Generator) -> Any:
        count, views = self._sized(generator)
        rooms = self.sets[draws.number]
        seek = getattr(rooms, "seek", None)
        if seek is not None:  # of sets whose steps differ
            seek(self.state.begun)
        return rooms.draw(count, views, generator).to(self.options.device)

    def _update(self, told: list[dict[str, float]], seeds: list[Any]) -> None:
        options, rule = self.options, self.options.optimising
        trained = [p for group in self.optimiser.param_groups for p in group["params"]]
        norm = nn.utils.clip_grad_norm_(trained, rule.clip)
        if not everywhere(bool(torch.isfinite(norm)), options.device):
            self._skip(seeds, False)
            return
        peak = options.learning_rate or self.stage.learning_rate
        rate = learning_rate(self.state.step, self._progress(), peak, rule)
        for group in self.optimiser.param_groups:
            group["lr"] = rate * group["share"]
        self.optimiser.step()
        self.state.step += 1
        self.bad = 0
        self._average()
        for parts in told:
            self._count({**parts, "norm": float(norm.detach())})

    def _skip(self, seeds: Any, good: bool) -> None:
        """Leave a step out; `good`: this process's own batch was finite."""
        self.bad += 1
        named = [seeds for seeds in gathered(None if good else seeds) if seeds is not None]
        said = "%s: step %d skipped, loss or gradient not finite (seeds %s)"
        if leads():
            log.warning(said, self.stage.name, self.state.step, named)
        self._write({"kind": "skipped", "seeds": named})
        if self.bad >= MAX_BAD:
            raise RuntimeError(
                f"{self.stage.name}: {MAX_BAD} steps on end gave no finite loss, the last with the batches "
                f"{named}; lower the learning rate"
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
        everyone = gathered((self.sums, self.counted))
        counted = sum(count for _, count in everyone)
        if counted:
            keys = dict.fromkeys(key for sums, _ in everyone for key in sums)
            means = {k: sum(sums.get(k, 0.0) for sums, _ in everyone) / counted for k in keys}
            rate = self.optimiser.param_groups[0]["lr"]
            self._write({"kind": "train", "rate": rate, **{k: round(v, 7) for k, v in means.items()}})
        self.sums, self.counted = {}, 0

    def _validate(self) -> None:
        """By the process that leads; the others wait for it at their next step."""
        if not leads():
            return
        own = {k: v.detach().clone() for k, v in stage_parameters(self.network, self.stage).items()}
        self.network.load_state_dict(self.state.ema, strict=False)
        self.network.eval()
        with self._spending("validation"), torch.inference_mode():
            metrics = self.validate(self.network) if self.validate is not None else {}
        self.network.load_state_dict(own, strict=False)
        for name in modules_of(self.network, self.stage):
            getattr(self.network, name).train()
        self._write({"kind": "validation", **{k: round(v, 5) for k, v in metrics.items()}})

    def _write(self, row: dict) -> None:
        if not leads():
            return
        head = {"stage": self.stage.name, "step": self.state.step, "seconds": round(self.state.seconds, 1)}
        log.info("%s", {**head, **row})
        self.run_dir.mkdir(parents=True, exist_ok=True)
        with (self.run_dir / f"{self.stage.name}.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps({**head, **row}) + "\n")
        self.board.show(row["kind"], row, self.state.step)

    def _save(self) -> None:
        with self._spending("saving"):
            path = self.run_dir / f"{self.stage.name}.pt"
            save_state(path, self.network, self.stage, self.optimiser, self.state, all_states(self.draws))

    @contextmanager
    def _spending(self, what: str) -> Iterator[None]:
        """Adds the seconds inside to what `what` took. (A card is waited for: losses and norms are read.)"""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.spent[what] = self.spent.get(what, 0.0) + time.perf_counter() - start


def _part(rooms: Drawn, number: int, batches: int) -> Drawn:
    """What one batch of a step reads, so that processes read different parts of a set; all of it where there
    is one batch, or where the set knows no parts."""
    part = getattr(rooms, "part", None)
    return rooms if part is None or batches == 1 else part(number, batches)


def learning_rate(step: int, progress: float, peak: float, rule: Optimising | None = None) -> float:
    """Linear warm-up, then a cosine over the budget down to the final share of the peak."""
    rule = rule or Optimising()
    warm = min(1.0, (step + 1) / rule.warm_up)
    cosine = rule.final_share + (1 - rule.final_share) * 0.5 * (1 + math.cos(math.pi * progress))
    return peak * warm * cosine
