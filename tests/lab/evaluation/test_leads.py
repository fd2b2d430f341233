"""Borders of words that photos show are told from their vectors, and so are those of words like them."""

import pytest
import torch
from torch.nn.functional import normalize

from langflash_core.errors import InputError
from langflash_core.lab.evaluation.leads import ABSENT, THERE, UNKNOWN, fitted_leads, write_leads
from langflash_core.language.leads import read_leads
from langflash_core.language.settings import RIVALS

TEMPERATURE = 10.0


def drawn(photos=4000, words=60, channels=6):
    """Words whose border is 2 + 1.5 t_0 in log odds: they score above it where they are, else below."""
    numbers = torch.Generator().manual_seed(3)
    vectors = normalize(torch.randn(words, channels, generator=numbers), dim=-1)
    truths = (torch.rand(photos, words, generator=numbers) < 0.2).long()
    odds = 2 + 1.5 * vectors[:, 0] + (2 * truths - 1) + torch.randn(photos, words, generator=numbers)
    truths[torch.rand(photos, words, generator=numbers) < 0.1] = UNKNOWN
    return odds.sigmoid(), truths, vectors


def test_words_with_a_high_border_start_behind():
    scores, truths, vectors = drawn()
    leads = fitted_leads(scores, truths, vectors, TEMPERATURE)
    # The mean keeps its lead; where a border is higher by 1.5, the lead is smaller by .15, of which the ridge
    # and noise take some.
    assert float(leads.of(vectors).mean()) == pytest.approx(RIVALS.lead, abs=1e-4)
    assert float(leads.direction[0]) == pytest.approx(-0.15, abs=0.01)
    assert float(leads.direction[1:].abs().max()) < 0.01


def test_words_that_no_photo_shows_are_told_by_those_like_them():
    scores, truths, vectors = drawn()
    truths[:, 40:] = torch.where(truths[:, 40:] == THERE, UNKNOWN, truths[:, 40:])
    leads = fitted_leads(scores, truths, vectors, TEMPERATURE)
    expected = RIVALS.lead - 0.15 * (vectors[40:, 0] - vectors[:, 0].mean())
    assert torch.allclose(leads.of(vectors[40:]), expected, rtol=0, atol=0.02)


def test_how_often_a_word_is_there_does_not_move_its_border():
    scores, truths, vectors = drawn()
    before = fitted_leads(scores, truths, vectors, TEMPERATURE)
    truths[2000:] = torch.where(truths[2000:] == THERE, UNKNOWN, truths[2000:])
    after = fitted_leads(scores, truths, vectors, TEMPERATURE)
    assert torch.allclose(after.direction, before.direction, rtol=0, atol=0.02)


def test_nothing_to_learn_from_is_said():
    with pytest.raises(InputError, match="no name is there in one photo and absent in another; give more"):
        fitted_leads(torch.full((2, 1), 0.5), torch.full((2, 1), ABSENT), torch.ones(1, 3), TEMPERATURE)


def test_written_leads_are_read(tmp_path):
    leads = fitted_leads(*drawn(), TEMPERATURE)
    write_leads(tmp_path / "leads.safetensors", leads)
    read = read_leads(tmp_path / "leads.safetensors")
    assert torch.equal(read.direction, leads.direction) and read.offset == pytest.approx(leads.offset)
