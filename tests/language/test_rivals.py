"""What a phrase loses where another name fits better."""

from dataclasses import replace

import pytest
import torch
from torch.nn.functional import normalize

from langflash_core.language.leads import Leads, shipped_leads
from langflash_core.language.relevance import (
    apart,
    compile_query,
    finite_dictionary,
    relevance_maps,
    rival_terms,
)
from langflash_core.language.rivals import alike, rivalry
from langflash_core.language.settings import RIVALS
from langflash_core.language.spaces import language_space
from langflash_core.types import Semantics
from tests.language.reference import beaten_twin


def drawn(count, channels, seed):
    values = torch.randn(count, channels, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)
    return normalize(values, dim=-1)


def lead_of(word):
    return shipped_leads().of(language_space().encode([word])).item()


def semantics_of(dictionary):
    count = len(dictionary)
    return Semantics(torch.arange(count)[:, None], torch.ones(count, 1), dictionary, "minilm")


def test_rivalry_is_its_twin():
    atoms, phrases, names = 1.7 * drawn(7, 4, 1), drawn(5, 4, 2), drawn(9, 4, 3)
    atoms[3] = 0
    leads = Leads(0.3 * drawn(1, 4, 4)[0], 0.07)
    found = rivalry(atoms, phrases, names, leads=leads)
    constants = (RIVALS.kin, RIVALS.behind, leads.offset, leads.direction.numpy())
    expected = [[beaten_twin(d.numpy(), t.numpy(), names.numpy(), constants) for t in phrases] for d in atoms]
    # Sums of four products near 1, of float64: a few of its steps of 2.2e-16.
    assert torch.allclose(found, torch.tensor(expected, dtype=torch.float64), rtol=0, atol=1e-14)
    assert (phrases @ names.T > RIVALS.kin).any(), "some name is kin"
    assert (found[3] == 0).all() and (found.amin() < 0)
    alone = rivalry(atoms, phrases, names)
    assert alone.amax() == RIVALS.lead and not torch.allclose(alone, found)


@pytest.mark.parametrize("repeated", [False, True])
def test_a_compiled_query_holds_it(repeated):
    space = language_space()
    dictionary = space.encode(["sofa", "table", "refrigerator", "lamp"]) * torch.tensor(
        [[1.0], [0.5], [1.0], [0.0]]
    )
    if repeated:
        dictionary = torch.cat((dictionary, dictionary[:2]))
    semantics = semantics_of(dictionary)
    asked = ["couch", "tv"]
    query, phrases = compile_query(semantics, space, asked), space.encode(asked)
    expected = dictionary @ phrases.T + rival_terms(
        finite_dictionary(semantics, space), space, asked, phrases
    )
    # float32 products of length 1, and what the inverse loses to `_SAME`.
    assert torch.allclose(query.factor @ query.prompts.T, expected, rtol=0, atol=2e-6)


def test_what_more_surely_answers_another_name_is_none():
    space = language_space()
    fridge, screen = normalize(
        torch.tensor([[1.0, 0.2], [0.2, 1.0]]) @ space.encode(["refrigerator", "tv"]), dim=-1
    )
    semantics = semantics_of(torch.stack((fridge, screen)))
    at = torch.eye(2)[None]
    alone, beside = (
        relevance_maps(at, compile_query(semantics, own, ["tv"]))[0, 0]
        for own in (replace(space, rivals=()), space)
    )
    assert beside[0] < alone[0] and beside[1] > alone[1]


def test_names_of_the_same_thing_are_no_rivals():
    names = ["picture", "wall", "bedside table"]
    assert alike(["painting", "night table", "violin"], names).tolist() == [
        [True, False, False],
        [False, False, True],
        [False, False, False],
    ]
    space = language_space()
    picture, wall = space.encode(["picture", "wall"]).split(1)
    added = rival_terms(
        picture, replace(space, rivals=("picture",)), ["painting"], space.encode(["painting"])
    )
    assert added.item() == pytest.approx(lead_of("painting"))
    assert (
        rival_terms(wall, replace(space, rivals=("wall",)), ["painting"], space.encode(["painting"])).item()
        < 0
    )


def test_a_name_written_apart_is_the_name():
    space = replace(language_space(), rivals=("bedside table", "wall"))
    asked = ["night stand", "nightstand", "white wall lamp", "wall"]
    assert apart(asked, space, space.encode(asked)).tolist() == [
        [True, True], [False, False], [False, False], [False, False],
    ]  # fmt: skip
    wall, stand = space.encode(["wall", "night stand"]).split(1)
    assert rival_terms(wall, space, ["night stand"], stand).item() == pytest.approx(lead_of("night stand"))


def test_nothing_has_no_rivals():
    space = language_space()
    added = rival_terms(space.encode(["tv"]), replace(space, rivals=()), ["couch"], space.encode(["couch"]))
    assert added.tolist() == [[0.0]]
    query = compile_query(semantics_of(torch.zeros(0, 384)), language_space(), ["tv"])
    assert query.prompts.shape == (1, 0)
