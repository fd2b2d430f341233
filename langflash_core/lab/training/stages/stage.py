"""What a stage of training is, and what all of them read of a network and a batch."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.lab.training.batches import SceneBatch
from langflash_core.lab.training.words import PhraseSampler
from langflash_core.network.encoders.shared import Tokens
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet
from langflash_core.network.pointmaps import PointMapNet


@dataclass(frozen=True)
class Words:
    """What the meaning stages say: a sampler, and a generator that makes it repeatable."""

    sampler: PhraseSampler
    generator: torch.Generator


@dataclass(frozen=True)
class Loss:
    """total: scalar to minimise; parts: named numbers for the log."""

    total: Tensor
    parts: dict[str, float] = field(default_factory=dict)


StageLoss = Callable[[LangFlashNet, Any, Words], Loss]
"""Network, what the stage's set draws (a `SceneBatch`; for naming a `PartBatch`), words -> loss."""


@dataclass(frozen=True)
class Stage:
    """modules: attributes of the network that learn; needs: stages whose modules are read frozen;
    views: how many views a scene gives, with their chances; learning_rate: AdamW's peak; photos: share
    of the pictures that come from labelled photos, where some are cached; rates: what a module's rate is of
    the stage's, 1 where it is not named; dense: SAM's embedding of rooms is drawn with them."""

    name: str
    modules: tuple[str, ...]
    needs: tuple[str, ...]
    views: dict[int, float]
    pictures: int
    learning_rate: float
    loss: StageLoss
    photos: float = 0.0
    rates: Mapping[str, float] = field(default_factory=dict)
    dense: bool = False


def tokens_of(network: LangFlashNet, batch: SceneBatch) -> Tokens:
    """Tokens of a batch, also what the late halves say, which no cache holds: they learn."""
    if not network.caches_tokens:  # but `frozen` keeps them while nothing before them learns
        return network.encode(batch.images, batch.Ks) if batch.frozen is None else batch.frozen.tokens
    with torch.no_grad():
        return network.encode(batch.images, batch.Ks)


def frozen_tokens(network: LangFlashNet, batch: SceneBatch) -> Tokens:
    """The cached tokens of the frozen encoder alone, where there are any: for stages that name nothing."""
    cached = batch.tokens if network.caches_tokens else None
    return tokens_of(network, batch) if cached is None else cached


def guided(network: LangFlashNet) -> GuidedDepthNet:
    """The network, for stages that only guided depth has.

    Raises:
        InputError: it predicts point maps.
    """
    if not isinstance(network, GuidedDepthNet):
        raise InputError(
            f"the preset '{network.preset.name}' has no such stage; "
            "train points, grouping, aggregation instead"
        )
    return network


def pointed(network: LangFlashNet) -> PointMapNet:
    """The network, for stages that only point maps have.

    Raises:
        InputError: it predicts depth.
    """
    if not isinstance(network, PointMapNet):
        raise InputError(
            f"the preset '{network.preset.name}' predicts depth, not point maps; train depth and refine"
        )
    return network


def modules_of(network: LangFlashNet, stage: Stage) -> tuple[str, ...]:
    """Those of the stage's modules that this kind of network has."""
    return tuple(name for name in stage.modules if hasattr(network, name))


def chosen_views(batch: SceneBatch, chosen: Iterable[int]) -> SceneBatch:
    """The batch with only some views."""
    keep = list(chosen)
    tokens = None if batch.tokens is None else batch.tokens.views(keep)
    return SceneBatch(
        batch.images[:, keep], batch.depths[:, keep], batch.instances[:, keep],
        batch.viewmats[:, keep], batch.Ks[:, keep], tokens, batch.labels, batch.seeds, batch.partly,
    )  # fmt: skip


def as_numbers(**parts: Tensor) -> dict[str, float]:
    """Scalars for the log."""
    return {name: float(value.detach()) for name, value in parts.items()}


def one_scene(batch: SceneBatch, index: int) -> SceneBatch:
    """One scene of a batch, B = 1."""
    one = slice(index, index + 1)
    tokens = None if batch.tokens is None else batch.tokens.scene(index)
    return SceneBatch(
        batch.images[one], batch.depths[one], batch.instances[one], batch.viewmats[one], batch.Ks[one],
        tokens, batch.labels[one], batch.seeds[one], batch.partly,
        None if batch.dense is None else batch.dense[one], batch.vectors[one],
        None if batch.frozen is None else batch.frozen.scene(index),
    )  # fmt: skip
