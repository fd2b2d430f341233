"""What a phrase starts with, by what kind of word it is. P phrases, C channels.

A network that saw a thing often scores its word high where the thing is, and rather high where it is not; a
word that it saw seldom scores low in both. Which of the two a phrase is, its vector t tells: the score at
which a thing is as likely there as not is nearly linear in it. So a phrase gets lead(t) = offset + direction
. t in the place of one number for all, and what is left means the same for every word, asked or compared.
`lab/evaluation/leads.py` learns it from labelled photos. Own: borders are told from vectors, so that words
that nobody labelled have one.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import torch
from jaxtyping import Float
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor

from langflash_core.base.resources import asset_path
from langflash_core.base.shipped import check_shipped
from langflash_core.errors import WeightsError
from langflash_core.language.settings import RIVALS

FILE = "weights/minilm_leads.safetensors"


@dataclass(frozen=True)
class Leads:
    """direction: one number where all phrases get the same. reliability: rows (score, share of phrases
    that scored so and were there), of photos kept aside; none: nobody measured it."""

    direction: Float[Tensor, " C"]
    offset: float
    reliability: tuple[tuple[float, float], ...] = ()

    def of(self, phrases: Float[Tensor, "P C"]) -> Float[Tensor, " P"]:
        """Cosines (P,) that phrases of unit vectors (P, C) get."""
        return self.offset + (phrases * self.direction.to(phrases)).sum(-1)


ALL_THE_SAME = Leads(torch.zeros(1), RIVALS.lead)


@lru_cache(maxsize=1)
def shipped_leads() -> Leads:
    """Of the shipped network, in MiniLM's space.

    Raises:
        WeightsError: the file is missing, damaged, or not the one that was shipped.
    """
    try:
        path = asset_path(FILE)
    except FileNotFoundError as error:
        raise WeightsError(str(error)) from error
    check_shipped(path)
    return read_leads(path)


def read_leads(path: Path) -> Leads:
    """
    Raises:
        WeightsError: it holds no leads.
    """
    try:
        tensors = load_file(path)
        rows = tensors.get("reliability", torch.zeros(0, 2)).tolist()
        return Leads(tensors["direction"].float(), float(tensors["offset"]), tuple((s, p) for s, p in rows))
    except (OSError, SafetensorError, KeyError, ValueError, RuntimeError) as error:
        raise WeightsError(f"{path.name} is damaged ({error}); reinstall LangFlash") from error


def nearer_threshold(threshold: float, temperature: float) -> float:
    """The relevancy from which a phrase counts as present that scores `threshold` without leads."""
    if not 0 < threshold < 1:
        return threshold
    return 1 / (1 + math.exp(RIVALS.nearer * temperature) * (1 / threshold - 1))
