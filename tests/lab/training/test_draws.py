"""A run goes on with the very draws of every generator that layers use, the card's among them."""

import pytest
import torch

from langflash_core.lab.training.draws import Draws, begin_draws
from langflash_core.lab.training.loop import LoopOptions, train_stage
from langflash_core.lab.training.stages.table import STAGES


@pytest.fixture
def card(monkeypatch) -> torch.Generator:
    """A generator in the place of a card's, where there is no card."""
    stand_in = torch.Generator().manual_seed(3)
    monkeypatch.setattr(torch.cuda, "is_initialized", lambda: True)
    monkeypatch.setattr(torch.cuda, "get_rng_state", stand_in.get_state)
    monkeypatch.setattr(torch.cuda, "set_rng_state", stand_in.set_state)
    fresh = torch.Generator
    monkeypatch.setattr(torch, "Generator", lambda device="cpu": fresh())
    return stand_in


def _drawn(draws: list[Draws], card: torch.Generator) -> list[float]:
    found = []
    for each in draws:
        with each.drawing():
            found.append(float(torch.rand((), generator=card)))
    return found


@pytest.mark.parametrize("batches", [1, 2])
def test_what_a_card_draws_goes_on_where_it_stopped(batches, words, card):
    draws = begin_draws(words, batches, seed=5)
    _drawn(draws, card)
    saved = [each.state() for each in draws]
    expected = _drawn(draws, card)
    card.manual_seed(99)  # another process
    again = begin_draws(words, batches, seed=5)
    for each, state in zip(again, saved, strict=True):
        each.restore(state)
    assert _drawn(again, card) == expected


def test_batches_of_a_step_draw_apart_on_a_card_and_leave_its_generator_alone(words, card):
    before = card.get_state()
    first, second = _drawn(begin_draws(words, 2, seed=5), card)
    assert first != second and torch.equal(card.get_state(), before)


def test_a_run_from_before_goes_on_on_a_card(words, card):
    (draws,) = begin_draws(words, 1, seed=5)
    state = {name: value for name, value in draws.state().items() if name != "card"}
    before = card.get_state()
    draws.restore(state)
    assert torch.equal(card.get_state(), before)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a graphics card")
def test_averages_lie_on_the_card_after_a_run_went_on(rooms, words, network, tmp_path):
    options = LoopOptions(minutes=1e6, max_steps=1, pictures=2, device="cuda")
    train_stage(network(), STAGES["depth"], rooms, words, tmp_path, options)
    state = train_stage(network(), STAGES["depth"], rooms, words, tmp_path, options)
    assert {value.device.type for value in state.ema.values()} == {"cuda"}
