"""Open-vocabulary relevance. K atoms, C channels, r = min(K, C), P prompts, M negatives.

Splatting is linear, so the feature at a pixel is F(p) = sum_k W_k(p) d_k = W(p) D and is never
formed. With the thin factorisation D = R Q, the rows of Q orthonormal,

    F = (W R) Q,   |F| = |W R|,   F . t = (W R) . (Q t),

both exact. A compiled query holds R, Q t and Q n: nothing of it is wider than K. What rivals add to a phrase
(`rivals.py`) is a number an atom, a_k. |d_k| a_k = (R x)_k has a solution where no atom is a mixture of
others, and Q t + x is held.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from langflash_core.errors import PromptError, SceneFileError
from langflash_core.language.algebra import encode_prompts
from langflash_core.language.grammar import Reading
from langflash_core.language.hints import hints
from langflash_core.language.leads import nearer_threshold
from langflash_core.language.rivals import alike, rivalry
from langflash_core.language.settings import RELEVANCE, RIVALS
from langflash_core.language.spaces import LanguageSpace, encode_cached
from langflash_core.language.taught import taught_dictionary
from langflash_core.types import Scene, Semantics

Mode = Literal["relevancy", "cosine"]


@dataclass(frozen=True)
class CompiledQuery:
    """P phrases made ready for one dictionary.

    factor: R (K, r). prompts: Q t + x (P, r). negatives: Q n (M, r), M = 0 in cosine mode.
    temperature > 0. threshold: from which relevance a phrase counts as present. texts,
    negative_texts: the phrases. notes: what people should know of each, or "" (`hints.py`). readings: of
    phrases whose heads alone were compiled; none: they are asked as they stand. others: heads of the things
    that they are related to.
    """

    factor: Float[Tensor, "K r"]
    prompts: Float[Tensor, "P r"]
    negatives: Float[Tensor, "M r"]
    temperature: float
    threshold: float
    mode: Mode
    texts: tuple[str, ...]
    negative_texts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    readings: tuple[Reading, ...] = ()
    others: "CompiledQuery | None" = None

    @property
    def narrows(self) -> bool:
        """Whether some phrase chooses among what answers its head (`narrowing.py`)."""
        return any(reading.narrows for reading in self.readings)


@dataclass(frozen=True)
class Calibration:
    """What a space, or the scene's own network, says about scores; fields as LanguageSpace."""

    temperature: float
    threshold: float
    cosine_threshold: float
    negatives: tuple[str, ...]


def finite_atoms(dictionary: Float[Tensor, "K C"]) -> Bool[Tensor, " K"]:
    """(K,) bool: every number of the atom is finite; the others count as atoms of length 0."""
    return torch.isfinite(dictionary).all(-1)


def reduce_dictionary(dictionary: Float[Tensor, "K C"]) -> tuple[Float[Tensor, "K r"], Float[Tensor, "r C"]]:
    """Thin factorisation D = R Q of a dictionary (K, C).

    Householder QR of D^T in float64: exact also where rows repeat, vanish, or outnumber the
    channels. K may be 0. Atoms that are not finite say nothing: they become 0.

    Returns:
        R (K, r) and Q (r, C) in the dictionary's dtype, r = min(K, C); Q Q^T = 1.

    Raises:
        ValueError: not a matrix.
    """
    if dictionary.dim() != 2:
        raise ValueError(f"dictionary: expected a (K, C) matrix, received {tuple(dictionary.shape)}")
    atoms = dictionary.detach().to("cpu", torch.float64)
    atoms = torch.where(finite_atoms(atoms)[:, None], atoms, 0.0)
    q, r = torch.linalg.qr(atoms.T, mode="reduced")  # (C, r), (r, K)
    return r.T.contiguous().to(dictionary), q.T.contiguous().to(dictionary)


def finite_dictionary(scene: Scene | Semantics, space: LanguageSpace) -> Float[Tensor, "K C"]:
    """The dictionary (K, C) as queries see it: as `spoken_dictionary`, atoms that are not finite are 0."""
    dictionary = spoken_dictionary(scene, space)
    return torch.where(finite_atoms(dictionary)[:, None], dictionary, 0.0)


def calibration_of(scene: Scene | None, space: LanguageSpace) -> Calibration:
    """The scene's own calibration (`Record.calibration`) over the defaults of its space, its threshold as far
    lower as rivals and leads ask (`Rivals.nearer`).

    Raises:
        SceneFileError: the scene's calibration is not usable.
    """
    own: Mapping[str, Any] = scene.record.calibration if scene is not None else {}
    try:
        chosen = Calibration(
            float(own.get("temperature", space.temperature)),
            float(own.get("threshold", space.threshold)),
            float(own.get("cosine_threshold", space.cosine_threshold)),
            tuple(str(text) for text in own.get("negatives", space.negatives)),
        )
    except (TypeError, ValueError, AttributeError) as error:
        raise SceneFileError(f"the scene's calibration is damaged ({error}); make it again") from error
    if not (chosen.temperature > 0 and 0 <= chosen.threshold <= 1 and -1 <= chosen.cosine_threshold <= 1):
        raise SceneFileError(f"the scene's calibration is out of range ({chosen}); make it again")
    if not space.rivals:
        return chosen
    return replace(chosen, threshold=nearer_threshold(chosen.threshold, chosen.temperature))


def compile_query(
    scene: Scene | Semantics,
    space: LanguageSpace,
    prompts: Sequence[str],
    *,
    negatives: Sequence[str] | None = None,
    mode: Mode = "relevancy",
) -> CompiledQuery:
    """Encode phrases and bring them into the dictionary's own r dimensions.

    Args:
        scene: a scene, or its semantics alone (then the space's default calibration holds).
        space: must be the one the dictionary lives in.
        prompts: phrases, with the light algebra of `query.algebra`.
        negatives: instead of the calibrated ones.
        mode: "relevancy" in (0, 1) or "cosine" in [-1, 1].

    Raises:
        PromptError: no prompt, an empty prompt, no negative, an unknown mode, another space.
        WeightsError: the space has no text weights.
    """
    semantics = scene.semantics if isinstance(scene, Scene) else scene
    _check_spoken(semantics, space, prompts, mode)
    calibration = calibration_of(scene if isinstance(scene, Scene) else None, space)
    texts = tuple(prompt.strip() for prompt in prompts)
    against = tuple(calibration.negatives if negatives is None else negatives) if mode == "relevancy" else ()
    if mode == "relevancy" and not against:
        raise PromptError("relevancy needs a negative phrase to compare with; name one, or use 'cosine'")
    dictionary = finite_dictionary(scene, space)
    factor, basis = reduce_dictionary(dictionary)
    vectors = encode_prompts(space, texts).to(basis)
    judged = vectors @ basis.T
    if mode == "relevancy":
        judged = judged + _in_factor(factor, rival_terms(dictionary, space, texts, vectors))
    return CompiledQuery(
        factor=factor,
        prompts=judged,
        negatives=encode_cached(space, against).to(basis) @ basis.T,
        temperature=calibration.temperature,
        threshold=calibration.threshold if mode == "relevancy" else calibration.cosine_threshold,
        mode=mode,
        texts=texts,
        negative_texts=against,
        notes=hints(scene, texts),
    )


def rival_terms(
    dictionary: Float[Tensor, "K C"],
    space: LanguageSpace,
    texts: Sequence[str],
    phrases: Float[Tensor, "P C"],
) -> Float[Tensor, "K P"]:
    """What rivals add to products of atoms and phrases, which say `texts`; nothing in a space without."""
    if not space.rivals:
        return dictionary.new_zeros(len(dictionary), len(phrases))
    names = encode_cached(space, space.rivals).to(dictionary)
    kin = alike(texts, space.rivals) | apart(texts, space, phrases.cpu())
    return dictionary.norm(dim=-1, keepdim=True) * rivalry(
        dictionary, phrases, names, kin.to(dictionary.device), space.leads()
    )


def apart(texts: Sequence[str], space: LanguageSpace, phrases: Float[Tensor, "P C"]) -> Bool[Tensor, "P V"]:
    """All names of phrases that are names written apart: their own vectors are too poor to be compared.
    "night stand" is nearest to "tv stand" (.59), "nightstand" to "bedside table" (.68)."""
    kin = torch.zeros(len(texts), len(space.rivals), dtype=torch.bool)
    two = [row for row, text in enumerate(texts) if len(text.split()) == 2]
    if two:
        names = encode_cached(space, space.rivals)
        own = phrases[two].to(names) @ names.T > RIVALS.kin
        joined = (
            encode_cached(space, tuple("".join(texts[row].split()) for row in two)) @ names.T > RIVALS.kin
        )
        kin[two] = (joined & ~own).any(1, keepdim=True) & ~own.any(1, keepdim=True)
    return kin


def _in_factor(factor: Tensor, products: Tensor) -> Tensor:
    """x (P, r) with R x = products (K, P), the shortest one; of more atoms than channels the nearest."""
    inverse = torch.linalg.pinv(factor.detach().to("cpu", torch.float64), rtol=RELEVANCE.same)
    return (inverse @ products.to(inverse)).T.to(factor)


def relevancy(
    positives: Float[Tensor, " P *at"], negatives: Float[Tensor, " M *at"], temperature: float
) -> Float[Tensor, " P *at"]:
    """Smallest, over the negatives, of softmax(temperature * [pos, neg])_pos.

    Each pair's softmax is sigmoid(temperature * (pos - neg)), which falls as neg rises: the
    smallest belongs to the largest negative. Finite for any finite logits.

    Args:
        positives: (P, ...). negatives: (M, ...), M >= 1. temperature: > 0.

    Returns:
        (P, ...) in (0, 1); below 0.5 a negative fits better.

    Raises:
        ValueError: there is no negative.

    Source: Kerr et al. 2023 (LERF), equation of section 4.2; twin `softmax_relevancy`.
    """
    if negatives.shape[0] == 0:
        raise ValueError("negatives: expected at least one, received none")
    return torch.sigmoid(temperature * (positives - negatives.amax(0)))


def relevance_maps(
    weight_maps: Float[Tensor, "*at K"], compiled: CompiledQuery, eps: float = RELEVANCE.empty_norm
) -> Float[Tensor, " P *at"]:
    """Relevance of every prompt at every pixel.

    Args:
        weight_maps: (..., K), as (H, W, K), composited w_ik.
        eps: floor on |F(p)|.

    Returns:
        (P, ...), cosine or relevancy as `compiled.mode` says; exactly 0 at empty pixels.

    Raises:
        ValueError: K disagrees.
    """
    return feature_relevance(weight_maps, compiled, lambda part: _features(part, compiled.factor), eps)


def feature_relevance(
    maps: Float[Tensor, "*at d"],
    compiled: CompiledQuery,
    decode: Callable[[Tensor], Tensor],
    eps: float = RELEVANCE.empty_norm,
) -> Float[Tensor, " P *at"]:
    """`relevance_maps` of whatever a decoder makes vectors F of, in the phrases' own numbers.

    Args:
        maps: (H, W, d). decode: (n, d) to F (n, r), a block of pixels at a time.

    Raises:
        ValueError: the vectors have other numbers than the phrases.
    """
    pixels = maps.flatten(0, -2)
    block = RELEVANCE.pixels_at_once if pixels.device.type == "cpu" else RELEVANCE.on_a_card
    found = [_relevance(decode(part), compiled, eps) for part in pixels.split(block)]
    return torch.cat(found, -1).unflatten(-1, maps.shape[:-1])


def _relevance(features: Tensor, compiled: CompiledQuery, eps: float) -> Tensor:
    """Relevance (P, n) of pixels F (n, r)."""
    phrases = torch.cat((compiled.prompts, compiled.negatives))
    cosines, empty = _cosines(features, phrases, eps)
    if compiled.mode == "cosine":
        return cosines.T
    positives, negatives = cosines.T.split((compiled.prompts.shape[0], compiled.negatives.shape[0]))
    return torch.where(empty.T, 0.0, relevancy(positives, negatives, compiled.temperature))


def _features(weights: Tensor, factor: Tensor) -> Tensor:
    """F (..., r) of weights (..., K), in the factor's dtype."""
    if weights.shape[-1] != factor.shape[0]:
        raise ValueError(f"weight_maps: expected K = {factor.shape[0]}, received {weights.shape[-1]}")
    return weights.to(factor) @ factor


def _cosines(features: Tensor, phrases: Tensor, eps: float) -> tuple[Tensor, Tensor]:
    """Cosines (..., P) of pixels F (..., r), 0 where empty, and the empty mask (..., 1)."""
    if phrases.shape[-1] != features.shape[-1]:
        raise ValueError(f"phrases: expected r = {features.shape[-1]}, received {phrases.shape[-1]}")
    norms = features.norm(dim=-1, keepdim=True)
    empty = norms < eps
    # Dividing by 1 where empty keeps gradients finite, too; rounding may leave [-1, 1] by an ulp.
    cosines = (features @ phrases.T) / torch.where(empty, 1.0, norms)
    return torch.where(empty, 0.0, cosines).clamp(-1, 1), empty


def spoken_dictionary(scene: Scene | Semantics, space: LanguageSpace) -> Float[Tensor, "K C"]:
    """The dictionary (K, C) as people taught the scene (`taught`); silent atoms are 0.

    Raises:
        PromptError: the scene speaks another language than `space`. WeightsError: that has no text weights.
    """
    if isinstance(scene, Semantics):
        _check_space(scene, space)
        return scene.dictionary
    _check_space(scene.semantics, space)
    silent = scene.record.silent_atoms
    dictionary = taught_dictionary(scene.semantics.dictionary, scene.record, space)
    rows = torch.tensor(silent, dtype=torch.int64, device=dictionary.device)
    return dictionary.index_fill(0, rows, 0.0) if silent else dictionary


def _check_spoken(semantics: Semantics, space: LanguageSpace, prompts: Sequence[str], mode: str) -> None:
    if mode not in get_args(Mode):
        raise PromptError(f"the mode '{mode}' is unknown; use 'relevancy' or 'cosine'")
    if isinstance(prompts, str) or not prompts:
        raise PromptError("there is no prompt; give a list with at least one word or short phrase")
    _check_space(semantics, space)


def _check_space(semantics: Semantics, space: LanguageSpace) -> None:
    channels = semantics.dictionary.shape[1]
    if semantics.space != space.name or channels != space.dimension:
        raise PromptError(
            f"the scene speaks '{semantics.space}' with {channels} numbers, the text tower "
            f"'{space.name}' with {space.dimension}; query the scene in its own language space"
        )
