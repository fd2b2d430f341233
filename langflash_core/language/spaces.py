"""Language spaces: a text tower, and what makes its scores comparable."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Protocol

from jaxtyping import Float
from torch import Tensor

from langflash_core.errors import PromptError
from langflash_core.language import clip, minilm
from langflash_core.language.leads import ALL_THE_SAME, Leads, shipped_leads
from langflash_core.language.vocabulary import OWN
from langflash_core.types import NO_LANGUAGE

# Kerr et al. 2023 (LERF), section 4.2.
NEGATIVES = ("object", "things", "stuff", "texture")


class TextTower(Protocol):
    """Anything that turns phrases into unit rows (P, C) float32."""

    def encode(self, texts: Sequence[str]) -> Float[Tensor, "P C"]: ...


@dataclass(frozen=True)
class LanguageSpace:
    """A named space of C numbers in which phrases and dictionary atoms are compared.

    dimension: C. temperature: factor on cosines inside `relevancy`, > 0. negatives: phrases
    that a present thing must beat. threshold: relevancy in (0, 1) from which a phrase counts as
    present; cosine_threshold: the same for `cosine`, in [-1, 1]. A trained network's own
    calibration, kept in the scene, goes before these defaults. load: gives the tower. rivals: names that
    take from a phrase what fits them better (`rivals.py`); none: it stands for itself. leads: gives
    what phrases start with beside rivals (`leads.py`).
    """

    name: str
    dimension: int
    temperature: float
    threshold: float
    cosine_threshold: float
    load: Callable[[], TextTower] = field(repr=False)
    negatives: tuple[str, ...] = NEGATIVES
    rivals: tuple[str, ...] = ()
    leads: Callable[[], Leads] = field(default=lambda: ALL_THE_SAME, repr=False)

    def encode(self, texts: Sequence[str]) -> Float[Tensor, "P C"]:
        """Unit embeddings (P, C) float32; the tower is read at the first call.

        Raises:
            PromptError: a phrase is empty or unknown. WeightsError: the tower has no weights.
        """
        return self.load().encode(texts)


@lru_cache(maxsize=64)
def encode_cached(space: LanguageSpace, texts: tuple[str, ...]) -> Float[Tensor, "P C"]:
    """`space.encode(texts)`, remembered: the negatives are the same at every key stroke.

    Do not change the result in place.
    """
    return space.encode(texts)


# Measured with the names of 40 household things as a perfect dictionary, 25 other words for
# them, and 20 things that no room has: relevancy >= 0.8 finds 84 % of the other words and
# refuses 90 % of the absent things; cosine >= 0.5 does 84 % and 80 %.
_MINILM = LanguageSpace(
    name="minilm",
    dimension=minilm.DIMENSION,
    temperature=10.0,
    threshold=0.8,
    cosine_threshold=0.5,
    load=minilm.load_minilm,
    rivals=tuple(OWN),
    leads=shipped_leads,
)
# Temperature and the border of relevancy as LERF has them; cosines of LSeg features with their
# own label lie around 0.2 to 0.3. Not calibrated here, for lack of CLIP weights.
_CLIP = LanguageSpace(
    name="clip",
    dimension=clip.DIMENSION,
    temperature=10.0,
    threshold=0.5,
    cosine_threshold=0.22,
    load=clip.load_clip,
)
_SPACES = {space.name: space for space in (_MINILM, _CLIP)}


def language_space(name: str = "minilm") -> LanguageSpace:
    """The space called `name`; its tower is read only when something is encoded.

    Raises:
        PromptError: there is no such space, or the scene came without language.
    """
    if name == NO_LANGUAGE:
        raise PromptError(
            "this splat file holds no language, so it answers no phrases yet; teach it some with "
            "langflash lift FILE -o SCENE.langflash, and ask that scene"
        )
    try:
        return _SPACES[name]
    except KeyError:
        known = " and ".join(_SPACES)
        raise PromptError(
            f"the language space '{name}' is unknown here; this version speaks {known}, "
            "so make the scene again or update LangFlash"
        ) from None
