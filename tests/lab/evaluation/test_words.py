"""The phrases of the evaluation: several dozens, of known things, and never taught."""

import torch
from torch.nn import functional as F

from langflash_core.lab.evaluation.words import PARAPHRASES, absent_phrases, paper_label
from langflash_core.lab.training.shards import Label
from langflash_core.lab.training.words import build_table
from langflash_core.language.vocabulary import OWN, further_words


def test_paraphrases_are_many_and_of_known_groups():
    assert 25 <= len(PARAPHRASES) <= 45
    assert all(groups and groups <= set(OWN) for groups in PARAPHRASES.values())


def test_training_never_says_a_paraphrase():
    labels = [Label(phrase, group, tuple(PARAPHRASES)) for phrase in PARAPHRASES for group in OWN]
    table = build_table(labels, lambda phrases: F.normalize(torch.ones(len(phrases), 4), dim=-1))
    assert not set(PARAPHRASES) & set(table.phrases)
    assert set(further_words("sofa")) <= set(table.phrases)


def test_labels_of_the_paper():
    assert paper_label("armchair") == paper_label("stool") == paper_label("chair")
    assert paper_label("lamp") == paper_label("yeti")


def test_absent_things_mean_something_else():
    groups = ["chair", "armchair", "lamp", "rug"]
    vectors = F.normalize(torch.tensor([[1.0, 0, 0], [1.0, 0.2, 0], [0, 1.0, 0], [0, 0, 1.0]]), dim=-1)
    generator = torch.Generator().manual_seed(0)
    assert set(absent_phrases(["chair"], groups, vectors, 4, generator)) == {"lamp", "rug"}
