"""A part with a meaning of its own: copies behind all others, whose lessons are about no other."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch.nn.functional import normalize

from langflash_core.errors import InputError
from langflash_core.geometry.surfels import covered_areas
from langflash_core.language.spaces import language_space
from langflash_core.language.taught import taught_dictionary
from langflash_core.scene import lone
from langflash_core.scene.edited import there
from langflash_core.scene.edits import Marks, allow_atom, deny_atom
from langflash_core.scene.file import load, save
from langflash_core.scene.joining import join_scenes
from langflash_core.scene.lone import mean_meaning, with_lone_part
from langflash_core.types import Scene
from tests.boxroom import WORDS, box_room

CHAIR = WORDS.index("chair")


@pytest.fixture(scope="module")
def room() -> Scene:
    return box_room()


@pytest.fixture(scope="module")
def part(room: Scene) -> torch.Tensor:
    """The chair at the left, and some of the wall, so that its meaning is mixed."""
    chairs = room.semantics.weight_ids[:, 0] == CHAIR
    left = room.gaussians.means[:, 0] < room.gaussians.means[chairs, 0].median()
    mixed = (chairs & left) | (torch.arange(len(chairs)) % 97 == 0)
    return mixed


def test_the_meaning_is_the_mean_by_area(room: Scene, part: torch.Tensor) -> None:
    """Twin: every Gaussian's feature, one by one."""
    total = np.zeros(room.semantics.dictionary.shape[1])
    areas = covered_areas(room.gaussians)
    for row in part.nonzero()[:, 0].tolist():
        weights = zip(room.semantics.weight_ids[row], room.semantics.weight_values[row], strict=True)
        for k, weight in weights:
            total += areas[row] * float(weight) * room.semantics.dictionary[int(k)].double().numpy()
    expected = total / np.linalg.norm(total)
    np.testing.assert_allclose(mean_meaning(room, part).numpy(), expected, atol=1e-5)  # float32 sums


def test_copies_carry_the_new_atom_and_nothing_else_changes(room: Scene, part: torch.Tensor) -> None:
    whole, count, atoms = with_lone_part(room, part), len(room.gaussians), room.semantics.num_atoms
    assert len(whole.gaussians) == count + int(part.sum()) and whole.semantics.num_atoms == atoms + 1
    assert torch.equal(whole.gaussians.means[count:], room.gaussians.means[part])
    assert (whole.semantics.weight_ids[count:, 0] == atoms).all()
    assert (whole.semantics.weight_values[count:].sum(1) == 1).all()
    assert whole.record.lone_atoms == (atoms,)
    back = there(whole, Marks.without_edits(count, atoms))
    assert back.record.lone_atoms == () and torch.equal(back.semantics.dictionary, room.semantics.dictionary)
    assert torch.equal(back.gaussians.means, room.gaussians.means)


def test_files_and_merges_keep_which_atoms_are_lone(room: Scene, part: torch.Tensor, tmp_path) -> None:
    whole, atoms = with_lone_part(room, part), room.semantics.num_atoms
    save(whole, tmp_path / "s.langflash")
    assert load(tmp_path / "s.langflash").record.lone_atoms == (atoms,)
    assert join_scenes(room, whole).record.lone_atoms == (2 * atoms,)
    assert join_scenes(whole, room).record.lone_atoms == (atoms,)


def test_what_a_lone_atom_is_denied_is_denied_to_no_other(room: Scene) -> None:
    space = language_space("minilm")
    chair = room.semantics.weight_ids[:, 0] == CHAIR
    whole, atoms = with_lone_part(room, chair), room.semantics.num_atoms
    denied = whole.with_record(atom_denials={atoms: ("chair",)})
    taught = taught_dictionary(whole.semantics.dictionary, denied.record, space)
    word = normalize(space.encode(["chair"])[0], dim=0)
    assert float(normalize(taught[atoms], dim=0) @ word) < -0.5  # on the other side
    assert torch.equal(taught[:atoms], whole.semantics.dictionary[:atoms])
    spread = replace(denied.record, lone_atoms=())
    assert not torch.equal(
        taught_dictionary(whole.semantics.dictionary, spread, space)[CHAIR], whole.semantics.dictionary[CHAIR]
    ), "without that the other chairs would have gone, too"


def test_a_denial_is_taken_back(room: Scene) -> None:
    marks = Marks.without_edits(3, 2)
    denied = deny_atom(marks, 1, "chair")
    assert allow_atom(denied, 1, "chair") == marks and allow_atom(denied, 1, "sofa") == denied


def test_what_cannot_be_is_said(room: Scene, part: torch.Tensor, monkeypatch) -> None:
    with pytest.raises(ValueError, match="at least one Gaussian"):
        with_lone_part(room, torch.zeros_like(part))
    monkeypatch.setattr(lone, "JOINING", replace(lone.JOINING, most_atoms=room.semantics.num_atoms))
    with pytest.raises(InputError, match="merge groups"):
        with_lone_part(room, part)
