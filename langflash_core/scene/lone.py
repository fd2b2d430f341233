"""A part of a scene with a meaning of its own, so that it can be told what it is not without telling others.

What groups are denied holds for all that look alike (`langflash_core.language.taught`), and two chairs share
a group. So the part's n Gaussians get a new atom: the mean of what they mean, by the area a_i of each,

    d = normalise(sum_i a_i f_i),   f_i = sum_k w_ik d_k,

with weight 1. Copies of them lie behind all others, as in a merge: who deletes the ones that they stand for
can undo that.
"""

from dataclasses import replace

import torch
from jaxtyping import Bool
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.errors import InputError
from langflash_core.geometry.surfels import covered_areas
from langflash_core.scene.joining import append_part
from langflash_core.scene.settings import JOINING
from langflash_core.types import Scene


def with_lone_part(scene: Scene, part: Bool[Tensor, " N"], shown: Scene | None = None) -> Scene:
    """The scene with copies of a part behind its Gaussians, which carry one new atom, the last; the record
    says that lessons about that one are about no other.

    Args:
        part: which, at least one. shown: the scene as edits moved it, of which copies are made; None: it.

    Raises:
        InputError: there are too many atoms. ValueError: the part is empty.
    """
    if not bool(part.any()):
        raise ValueError("part: expected at least one Gaussian")
    number = scene.semantics.num_atoms
    if number >= JOINING.most_atoms:
        raise InputError(
            f"at most {JOINING.most_atoms} groups can be shown; merge groups in the dictionary first"
        )
    semantics = scene.semantics
    dictionary = torch.cat((semantics.dictionary, mean_meaning(scene, part)[None].to(semantics.dictionary)))
    whole = replace(scene, semantics=replace(semantics, dictionary=dictionary))
    copies = replace(shown or scene, semantics=whole.semantics).rows(part)
    ids, values = (
        torch.zeros_like(copies.semantics.weight_ids),
        torch.zeros_like(copies.semantics.weight_values),
    )
    ids[:, 0], values[:, 0] = number, 1.0
    lone = replace(copies, semantics=replace(copies.semantics, weight_ids=ids, weight_values=values))
    return append_part(whole, lone).with_record(lone_atoms=(*scene.record.lone_atoms, number))


def mean_meaning(scene: Scene, part: Bool[Tensor, " N"]) -> Tensor:
    """(C,) unit: what a part means as a whole; 0 where it means nothing."""
    some = scene.rows(part)
    areas = torch.from_numpy(covered_areas(some.gaussians)).to(some.semantics.dictionary)
    weights = (areas[:, None] * some.semantics.weight_values).flatten()
    shares = some.semantics.dictionary.new_zeros(some.semantics.num_atoms)
    shares = shares.index_add(0, some.semantics.weight_ids.flatten(), weights.to(shares))
    return normalize(shares @ some.semantics.dictionary, dim=0)
