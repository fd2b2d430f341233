"""What is drawn at random in a step, so that it does not depend on how many processes there are.

A step is made of batches. Each has draws of its own, for itself alone: a generator that picks scenes and
phrases, and the states of torch's common ones, which a few layers use: the processor's, and the card's where
the network lies on one. Processes share the batches, so two
processes with one batch each learn what one process with two learns, and a run goes on exactly where it
stopped, whoever goes on with it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.lab.training.ranks import gathered, rank, world
from langflash_core.lab.training.stages.stage import Words

_APART = 1_000_003
"""Between the seeds of two batches of a step."""


@dataclass(frozen=True)
class Common:
    """States of torch's own generators. card: None where none is in use."""

    processor: Tensor
    card: Tensor | None = None

    @staticmethod
    def now() -> "Common":
        card = torch.cuda.get_rng_state() if torch.cuda.is_initialized() else None
        return Common(torch.get_rng_state(), card)

    @staticmethod
    def seeded(seed: int) -> "Common":
        """Those of generators that nothing has drawn from."""
        card = torch.Generator("cuda").manual_seed(seed).get_state() if torch.cuda.is_initialized() else None
        return Common(torch.Generator().manual_seed(seed).get_state(), card)

    def set(self) -> None:
        """Draw on from here; a run that comes from a machine without a card leaves the card's as it is."""
        torch.set_rng_state(self.processor)
        if self.card is not None and torch.cuda.is_initialized():
            torch.cuda.set_rng_state(self.card)


@dataclass
class Draws:
    """The draws of one batch of every step. words: with its generator. common: of torch's own generators,
    None where this is the only batch and the process keeps them anyway. number: of the batch in a step."""

    words: Words
    common: Common | None = None
    number: int = 0

    @contextmanager
    def drawing(self) -> Iterator[Words]:
        """Inside, torch's common generators are this batch's."""
        if self.common is None:
            yield self.words
            return
        outside = Common.now()
        self.common.set()
        try:
            yield self.words
        finally:
            self.common = Common.now()
            outside.set()

    def state(self) -> dict[str, Tensor]:
        common = self.common or Common.now()
        card = {} if common.card is None else {"card": common.card}
        return {"own": self.words.generator.get_state(), "common": common.processor, **card}

    def restore(self, state: dict[str, Tensor]) -> None:
        self.words.generator.set_state(state["own"])
        common = Common(state["common"], state.get("card"))
        if self.common is None:
            common.set()
        else:
            self.common = common


def begin_draws(words: Words, batches: int | None, seed: int) -> list[Draws]:
    """Those of this process, of `batches` a step (None: one a process). The first batch of all draws as
    `words` says, whatever their number.

    Raises:
        InputError: the processes cannot share the batches evenly.
    """
    batches = world() if batches is None else batches
    if batches < 1 or batches % world():
        raise InputError(
            f"{batches} batches a step cannot be shared by {world()} processes; "
            "choose a multiple of their number with --batches"
        )
    own = batches // world()
    return [_draws(words, number, batches, seed) for number in range(rank() * own, (rank() + 1) * own)]


def _draws(words: Words, number: int, batches: int, seed: int) -> Draws:
    if number > 0:
        fresh = torch.Generator().manual_seed(words.generator.initial_seed() + _APART * number)
        words = replace(words, generator=fresh)
    return Draws(words, Common.seeded(seed + _APART * number) if batches > 1 else None, number)


def all_states(draws: list[Draws]) -> list[dict[str, Tensor]]:
    """Of all processes, batch by batch."""
    return [state for states in gathered([own.state() for own in draws]) for state in states]


def restore_draws(draws: list[Draws], states: list[dict[str, Tensor]]) -> None:
    """Go on as `all_states` was.

    Raises:
        InputError: it was of another number of batches.
    """
    if len(states) != len(draws) * world():
        raise InputError(
            f"this run has {len(states)} batches a step, not {len(draws) * world()}; "
            f"go on with --batches {len(states)}, or choose another -o"
        )
    for own, state in zip(draws, states[rank() * len(draws) :], strict=False):
        own.restore(state)
