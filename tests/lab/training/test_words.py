"""Phrases: every label gets one of its own, groups get their share, rare groups their weight."""

import pytest
import torch

from langflash_core.lab.training.shards import Label
from langflash_core.lab.training.words import BASELINES, PhraseSampler, build_table
from langflash_core.language.vocabulary import further_words
from tests.lab.training.conftest import encode

SOFA, TABLE = Label("red sofa", "sofa", ("couch", "chesterfield")), Label("oak table", "table")
LABELS = [Label("wall", "wall")] * 50 + [SOFA] * 2 + [TABLE] * 5 + [Label("grey yeti", "yeti")] * 5


def drawn(label: Label, count: int) -> list[str]:
    sampler = PhraseSampler(build_table(LABELS, encode))
    rows = sampler.draw([label] * count, torch.Generator().manual_seed(0))
    return [sampler.table.phrases[row] for row in rows]


def test_the_table_holds_every_phrase_once():
    table = build_table(LABELS, encode)
    assert list(table.phrases) == sorted(set(table.phrases))
    assert {"red sofa", "chesterfield", "settee", "grey yeti", *BASELINES} <= set(table.phrases)
    assert table.groups == ("sofa", "table", "wall", "yeti")
    assert table.group_counts.tolist() == [2, 5, 50, 5]
    assert [table.phrases[row] for row in table.group_rows()] == list(table.groups)
    with pytest.raises(ValueError, match="labels"):
        build_table([], encode)


def test_a_label_is_called_by_all_its_phrases_and_no_other():
    names = drawn(SOFA, 2000)
    assert set(names) == {"red sofa", "sofa", "chesterfield", *further_words("sofa")}
    assert 0.26 < names.count("red sofa") / 2000 < 0.34  # 0.3 by design; 4 sigma are 0.04
    assert 0.26 < names.count("sofa") / 2000 < 0.34


def test_a_label_without_further_words_is_name_or_group():
    names = drawn(LABELS[-1], 200)
    assert set(names) == {"grey yeti", "yeti"}
    assert 0.35 < names.count("grey yeti") / 200 < 0.65  # halves; 4 sigma are 0.14


def test_what_is_kept_for_the_evaluation_is_never_said():
    label = Label("couch", "sofa", ("the couch", "settee"))
    table = build_table([label], encode)
    assert not {"couch", "the couch"} & set(table.phrases)
    rows = PhraseSampler(table).draw([label] * 500, torch.Generator().manual_seed(0))
    assert "sofa" in {table.phrases[row] for row in rows}


def test_a_broad_phrase_is_true_of_every_thing_it_covers():
    chair, armchair, lamp = (Label(g, g) for g in ("chair", "armchair", "lamp"))
    labels = [SOFA, chair, armchair, lamp, Label("ceiling", "ceiling")]
    labels[3] = Label("lamp", "lamp", ("ceiling",))
    sampler = PhraseSampler(build_table(labels, encode))
    rows, true = sampler.table.index(), sampler.true(labels)
    assert true[:, rows["seating"]].tolist() == [True, True, True, False, False]
    assert true[:, rows["chair"]].tolist() == [False, True, True, False, False]
    assert true[:, rows["armchair"]].tolist() == [False, False, True, False, False]
    assert true[:, rows["ceiling"]].tolist() == [False, False, False, False, True]  # a tag of place
    assert not bool(true[:, rows["object"]].any())


def test_an_unlisted_name_is_false_of_other_groups_unless_it_is_near():
    labels = [
        Label("soft sofa", "sofa"),
        Label("big pendulum", "clock"),
        Label("old pendulum", "lamp"),
        TABLE,
    ]
    sampler = PhraseSampler(build_table(labels, encode))  # equal last words are equal vectors
    rows, true = sampler.table.index(), sampler.true(labels)
    assert true[:, rows["big pendulum"]].tolist() == [False, True, True, False]
    assert true[:, rows["soft sofa"]].tolist() == [True, False, False, False]


def test_rare_groups_weigh_more():
    sampler = PhraseSampler(build_table(LABELS, encode))
    wall, sofa, table = sampler.balance([LABELS[0], SOFA, TABLE]).tolist()
    assert wall < table < sofa
    assert sampler.groups([Label("ghost", "ghost")]).tolist() == [-1]
    assert sampler.balance([Label("ghost", "ghost")]).tolist() == [1.0]
