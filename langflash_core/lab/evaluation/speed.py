"""How long each stage of the network takes, and what computing in bfloat16 does to its answer.

The stages are those of the paper's table. Every row is timed with as many photos and groups as it
says; the error is against float32 with the same weights: |a - b| / |b| over all numbers that the
stage hands on, with what the stages before it handed on in the same precision.

V views, K groups.
"""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.base.running import Progress, Run, evenly
from langflash_core.network.model import LangFlashNet, Seen
from langflash_core.network.semantics.grouping import Groups, group_weights
from langflash_core.types import Views

STAGES = ("language features", "shared encoder", "grouping", "aggregation", "Gaussian decoder", "all")
PAPER_MS = {
    "language features": 6.0, "shared encoder": 32.0, "grouping": 38.0, "aggregation": 72.0,
    "Gaussian decoder": 32.0, "all": 180.0,
}  # fmt: skip
"""Liu et al. 2026, supplement: 2 photos of 256 x 256, K = 128; the GPU is not named."""


@dataclass(frozen=True)
class Plan:
    """What is measured: views and groups each by each, `repeats` times, pictures of `side` pixels;
    bfloat16: beside float32, where the network has a rule for it."""

    views: tuple[int, ...] = (2,)
    atoms: tuple[int, ...] = (128,)
    repeats: int = 3
    side: int = 256
    bfloat16: bool = True


@dataclass(frozen=True)
class Row:
    """One stage: median seconds on the clock, seconds of all cores together, its error (None: float32)."""

    precision: str
    views: int
    atoms: int
    stage: str
    seconds: float
    cpu_seconds: float
    error: float | None = None


@dataclass
class _Pass:
    """One run through stages: what they took and what they gave; chosen: queries that became groups."""

    seconds: dict[str, float] = field(default_factory=dict)
    cpu_seconds: dict[str, float] = field(default_factory=dict)
    given: dict[str, Tensor] = field(default_factory=dict)
    chosen: Tensor | None = None

    def timed(self, stage: str, work: Callable, device: torch.device):
        """What `work` gives; its time is added to the stage's."""
        _settle(device)
        clock, cpu = time.perf_counter(), time.process_time()
        answer = work()
        _settle(device)
        self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - clock
        self.cpu_seconds[stage] = self.cpu_seconds.get(stage, 0.0) + time.process_time() - cpu
        return answer


@dataclass(frozen=True)
class _Shared:
    """What does not depend on the number of groups: its times, the queries' answer, L(x), and what
    names groups besides."""

    done: _Pass
    groups: Groups
    features: Tensor
    seen: Seen


def measure_network(network: LangFlashNet, plan: Plan, progress: Progress | None = None) -> list[Row]:
    """Rows of every precision, number of views and number of groups.

    What does not depend on the groups is run once for all numbers of them. The network ends in
    bfloat16 where it has a rule for that: the change has no way back.
    """
    rows: list[Row] = []
    exact: dict[tuple[int, int], _Pass] = {}
    precisions = ("float32", "bfloat16") if plan.bfloat16 else ("float32",)
    steps = [(p, v) for p in precisions for v in plan.views]
    for number, (precision, num_views) in enumerate(steps):
        if progress is not None:
            progress(f"{precision}, {num_views} views", number / len(steps))
        if precision == "bfloat16" and number == len(steps) // 2:
            network.use_bfloat16()
        shared = [_share(network, plan.side, num_views) for _ in range(plan.repeats)]
        for atoms in plan.atoms:
            reference = exact.get((num_views, atoms))
            passes = [_finish(network, one, atoms, plan.side, reference) for one in shared]
            exact.setdefault((num_views, atoms), passes[0])
            rows += _rows(precision, num_views, atoms, passes, reference)
    return rows


def _rows(precision: str, views: int, atoms: int, passes: list[_Pass], reference: _Pass | None) -> list[Row]:
    rows = []
    for stage in STAGES:
        seconds = statistics.median(p.seconds[stage] for p in passes)
        cpu = statistics.median(p.cpu_seconds[stage] for p in passes)
        error = None
        if reference is not None and stage in reference.given:
            error = relative_error(passes[0].given[stage], reference.given[stage])
        rows.append(Row(precision, views, atoms, stage, seconds, cpu, error))
    return rows


def relative_error(found: Tensor, expected: Tensor) -> float:
    """|found - expected| / |expected|, Euclidean over all numbers; 0 where both are 0."""
    difference = (found.double() - expected.double()).norm()
    return float(difference / expected.double().norm().clamp_min(1e-30))


def random_views(num_views: int, side: int) -> Views:
    """Smooth random pictures that shift from view to view; speed does not depend on what they show."""
    coarse = torch.rand(1, 3, 16, 32, generator=torch.Generator().manual_seed(0))
    wide = F.interpolate(coarse, size=(side, 2 * side), mode="bicubic").clamp(0, 1)[0]
    step = side // (2 * max(num_views, 2))
    images = torch.stack([wide[:, :, v * step : v * step + side] for v in range(num_views)])
    K = torch.tensor([[0.9 * side, 0, side / 2], [0, 0.9 * side, side / 2], [0, 0, 1]])
    return Views(images, K.repeat(num_views, 1, 1), tuple(f"picture {v}" for v in range(num_views)))


@torch.inference_mode()
def _share(network: LangFlashNet, side: int, num_views: int) -> _Shared:
    """All stages, without what the number of groups changes."""
    device = next(network.parameters()).device
    views = random_views(num_views, side)
    images, Ks = views.images[None].to(device), views.Ks[None].to(device)
    done = _Pass()
    tokens = done.timed("shared encoder", lambda: network.encode(images, Ks), device)
    features = done.timed("language features", lambda: network.language(tokens, images), device)
    groups = done.timed("grouping", lambda: network.group(tokens, images)[-1], device)
    run = Run(evenly(network.stages))
    geometry = done.timed(
        "Gaussian decoder", lambda: network.reconstruct(views, images, Ks, tokens, run), device
    )
    gaussians = geometry.gaussians
    done.given |= {
        "shared encoder": torch.cat([hook.flatten().float() for hook in tokens.hooks]),
        "language features": features.float(),
        "Gaussian decoder": torch.cat(
            (gaussians.means, gaussians.scales, gaussians.opacities[:, None]), 1
        ).float(),
    }
    return _Shared(done, groups, features, Seen(images[0], tokens, geometry.depths, geometry.viewmats, Ks[0]))


@torch.inference_mode()
def _finish(network: LangFlashNet, shared: _Shared, atoms: int, side: int, reference: _Pass | None) -> _Pass:
    """Groups are the `atoms` of the highest scores, the reference's where there is one."""
    device = shared.features.device
    done = _Pass(dict(shared.done.seconds), dict(shared.done.cpu_seconds), dict(shared.done.given))
    if reference is not None and reference.chosen is not None:
        chosen = reference.chosen
    else:
        scores = shared.groups.existence_logits[0]
        chosen = scores.topk(min(atoms, len(scores))).indices
    weights = done.timed("grouping", lambda: group_weights(shared.groups, chosen, (side, side)), device)
    dictionary = done.timed(
        "aggregation", lambda: network.dictionary(weights, shared.features, shared.seen), device
    )
    done.chosen = chosen
    done.given |= {"grouping": weights.float(), "aggregation": dictionary.float()}
    done.seconds["all"] = sum(done.seconds.values())
    done.cpu_seconds["all"] = sum(done.cpu_seconds.values())
    return done


def _settle(device: torch.device) -> None:
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def speed_table(rows: Sequence[Row]) -> str:
    """The rows as a Markdown table, one line per stage; the paper's milliseconds beside."""
    lines = [
        "| precision | views | groups | stage | ms | core ms | error | paper ms |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        error = "" if row.error is None else f"{row.error:.1e}"
        paper = PAPER_MS[row.stage] if (row.views, row.atoms) == (2, 128) else None
        lines.append(
            f"| {row.precision} | {row.views} | {row.atoms} | {row.stage} | {row.seconds * 1e3:,.0f} | "
            f"{row.cpu_seconds * 1e3:,.0f} | {error} | {'' if paper is None else f'{paper:g}'} |"
        )
    return "\n".join(lines)
