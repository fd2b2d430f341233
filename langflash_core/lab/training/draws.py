"""What is drawn at random in a step, so that it does not depend on how many processes there are.

A step is made of batches. Each has draws of its own, for itself alone: a generator that picks scenes and
phrases, and the state of torch's common one, which a few layers use. Processes share the batches, so two
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
from langflash_core.lab.training.stages import Words

_APART = 1_000_003
"""Between the seeds of two batches of a step."""


@dataclass
class Draws:
    """The draws of one batch of every step. words: with its generator. common: state of torch's own
    generator, None where this is the only batch and the process keeps it anyway."""

    words: Words
    common: Tensor | None = None

    @contextmanager
    def drawing(self) -> Iterator[Words]:
        """Inside, torch's common generator is this batch's."""
        if self.common is None:
            yield self.words
            return
        outside = torch.get_rng_state()
        torch.set_rng_state(self.common)
        try:
            yield self.words
        finally:
            self.common = torch.get_rng_state()
            torch.set_rng_state(outside)

    def state(self) -> dict[str, Tensor]:
        common = torch.get_rng_state() if self.common is None else self.common
        return {"own": self.words.generator.get_state(), "common": common}

    def restore(self, state: dict[str, Tensor]) -> None:
        self.words.generator.set_state(state["own"])
        if self.common is None:
            torch.set_rng_state(state["common"])
        else:
            self.common = state["common"]


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
    common = torch.Generator().manual_seed(seed + _APART * number).get_state()
    if number > 0:
        fresh = torch.Generator().manual_seed(words.generator.initial_seed() + _APART * number)
        words = replace(words, generator=fresh)
    return Draws(words, common if batches > 1 else None)


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
            f"go on with --batches {len(states)}, or begin anew with --restart"
        )
    for own, state in zip(draws, states[rank() * len(draws) :], strict=False):
        own.restore(state)
