"""Words start ahead by what kind they are: those seen often need a higher score than those seen seldom."""

from dataclasses import replace

import pytest
import torch
from safetensors.torch import save_file
from torch.nn.functional import normalize

from langflash_core.errors import WeightsError
from langflash_core.language.leads import nearer_threshold, read_leads, shipped_leads
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.settings import RIVALS
from langflash_core.language.spaces import language_space
from langflash_core.language.vocabulary import EVALUATED, OWN
from langflash_core.types import Semantics

OFTEN, SELDOM = ("floor", "sofa", "cabinet", "curtain"), ("cup", "coffee machine", "glass jar", "ball")


def semantics_of(dictionary):
    count = len(dictionary)
    return Semantics(torch.arange(count)[:, None], torch.ones(count, 1), dictionary, "minilm")


def test_what_is_seen_often_starts_behind_what_is_seen_seldom():
    often, seldom = (shipped_leads().of(language_space().encode(words)) for words in (OFTEN, SELDOM))
    assert float(often.max()) < RIVALS.lead < float(seldom.min())


def test_words_kept_for_asking_have_leads_like_all_others():
    """They follow from their vectors, as those of words that nobody labelled do."""
    kept, own = (
        shipped_leads().of(language_space().encode(list(words))).mean() for words in (EVALUATED, OWN)
    )
    assert abs(float(kept - own)) < 0.03


def test_of_words_that_score_alike_the_one_that_seldom_does_is_meant():
    """The other loses as a phrase that is beaten by a rival, too."""
    space = language_space()
    words = space.encode(["cabinet", "microwave"])
    semantics = semantics_of(normalize(words.sum(0), dim=0)[None])
    maps = relevance_maps(torch.ones(1, 1, 1), compile_query(semantics, space, ["cabinet", "microwave"]))
    odds, leads = maps.flatten().logit(), shipped_leads().of(words)
    gained = space.temperature * (1 + RIVALS.behind) * (leads[1] - leads[0])
    assert float(odds[1] - odds[0]) == pytest.approx(float(gained), abs=1e-3)
    assert float(gained) > 1


@pytest.mark.parametrize("threshold", [0.0, 0.3, 0.87, 1.0])
def test_thresholds_are_as_much_nearer(threshold):
    found = torch.tensor(nearer_threshold(threshold, 10.0), dtype=torch.float64)
    expected = torch.tensor(threshold, dtype=torch.float64).logit() - 10 * RIVALS.nearer
    assert torch.allclose(found.logit(), expected)


def test_a_query_counts_from_the_nearer_threshold_and_cosines_do_not():
    semantics, space = semantics_of(language_space().encode(["bed"])), language_space()
    assert compile_query(semantics, space, ["bed"]).threshold == nearer_threshold(space.threshold, 10.0)
    assert compile_query(semantics, space, ["bed"], mode="cosine").threshold == space.cosine_threshold
    assert compile_query(semantics, replace(space, rivals=()), ["bed"]).threshold == space.threshold


def test_files_that_hold_no_leads_are_a_sentence(tmp_path):
    path = tmp_path / "leads.safetensors"
    save_file({"direction": torch.zeros(384)}, path)
    for content in (None, b"no tensors"):
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(WeightsError, match=r"leads\.safetensors is damaged .*; reinstall") as raised:
            read_leads(path)
        assert raised.value.exit_code == 2 and "\n" not in str(raised.value)
