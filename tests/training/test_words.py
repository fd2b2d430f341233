"""Phrases: every label gets one of its own, groups get their share, rare groups their weight."""

import pytest
import torch

from langflash_core.training.shards import Label
from langflash_core.training.words import PhraseSampler, build_table
from tests.training.conftest import encode

LABELS = [Label("wall", "wall")] * 50 + [Label("red sofa", "sofa", ("couch", "settee"))] * 2
LABELS += [Label("oak table", "table")] * 5


def test_the_table_holds_every_phrase_once():
    table = build_table(LABELS, encode)
    assert table.phrases == ("couch", "oak table", "red sofa", "settee", "sofa", "table", "wall")
    assert table.groups == ("sofa", "table", "wall")
    assert table.group_counts.tolist() == [2, 5, 50]
    assert [table.phrases[row] for row in table.group_rows()] == list(table.groups)
    with pytest.raises(ValueError, match="labels"):
        build_table([], encode)


def test_a_label_is_called_by_all_its_phrases_and_no_other():
    sampler = PhraseSampler(build_table(LABELS, encode))
    generator = torch.Generator().manual_seed(0)
    rows = sampler.draw([LABELS[50]] * 400, generator)
    names = [sampler.table.phrases[row] for row in rows]
    assert set(names) == {"red sofa", "sofa", "couch", "settee"}
    assert 0.2 < names.count("red sofa") / 400 < 0.4  # 0.3 by design; 4 sigma are 0.09
    assert 0.25 < names.count("sofa") / 400 < 0.45


def test_a_label_without_further_words_is_name_or_group():
    sampler = PhraseSampler(build_table(LABELS, encode))
    rows = sampler.draw([LABELS[-1]] * 200, torch.Generator().manual_seed(0))
    names = [sampler.table.phrases[row] for row in rows]
    assert set(names) == {"oak table", "table"}
    assert 0.35 < names.count("oak table") / 200 < 0.65  # halves; 4 sigma are 0.14


def test_rare_groups_weigh_more():
    sampler = PhraseSampler(build_table(LABELS, encode))
    wall, sofa, table = sampler.balance([LABELS[0], LABELS[50], LABELS[-1]]).tolist()
    assert wall < table < sofa
    assert sampler.groups([Label("yeti", "yeti")]).tolist() == [-1]
    assert sampler.balance([Label("yeti", "yeti")]).tolist() == [1.0]
