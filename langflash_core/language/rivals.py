"""What a phrase loses where another name fits better. K atoms, P phrases, V names, C channels.

Whatever is near a thing's own name scores, too: a kitchen without one has .84 of a "tv". So beside its cosine
c_kp with an atom a phrase gets

    lead_p - BEHIND max(0, max_v (c_kv + lead_v) - (c_kp + lead_p)),

over names v of household things that mean something else; leads: of `leads.py`. That is a number an atom and
phrase, so that a pixel costs what it did. Own; twin `beaten_twin`.
"""

from collections.abc import Sequence

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.language.leads import ALL_THE_SAME, Leads
from langflash_core.language.settings import RIVALS
from langflash_core.language.vocabulary import groups_of


def rivalry(
    atoms: Float[Tensor, "K C"],
    phrases: Float[Tensor, "P C"],
    names: Float[Tensor, "V C"],
    alike: Bool[Tensor, "P V"] | None = None,
    leads: Leads = ALL_THE_SAME,
) -> Float[Tensor, "K P"]:
    """What to add to the cosine of every atom and phrase; 0 of atoms of length 0.

    Args:
        atoms: any length. phrases, names: unit rows. alike: names that mean what a phrase means, beside those
            whose cosine says so. leads: what phrases and names start with.
    """
    units = normalize(atoms, dim=-1)
    ahead = leads.of(phrases)
    own, others = units @ phrases.T + ahead, units @ names.T + leads.of(names)  # (K, P), (K, V)
    kin = phrases @ names.T > RIVALS.kin
    kin = kin if alike is None else kin | alike
    best = torch.stack([others.masked_fill(each, -torch.inf).amax(1) for each in kin], 1)
    added = ahead - RIVALS.behind * (best - own).clamp_min(0)
    return torch.where(atoms.norm(dim=-1, keepdim=True) > 0, added, 0.0)


def alike(texts: Sequence[str], names: Sequence[str]) -> Bool[Tensor, "P V"]:
    """Whether the table of household words knows a phrase as one for a name: "painting" and "picture" have a
    cosine of .4."""
    groups = [groups_of(text) for text in texts]
    return torch.tensor([[name in own for name in names] for own in groups])
