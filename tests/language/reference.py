"""Slow float64 twins of the query stage, each written another way than the code it checks."""

import math
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.numpy import load_file
from scipy.special import erf
from torch import Tensor


def bert_twin(weights: Path, token_ids: list[int]) -> NDArray[np.float64]:
    """MiniLM's unit embedding (384,) of one token sequence, in NumPy float64, head by head."""
    stored = load_file(weights)

    def get(key: str) -> NDArray[np.float64]:
        dense = stored[key].astype(np.float64)
        scale = stored.get(key + ".scale")
        return dense if scale is None else dense * scale.astype(np.float64)[:, None]

    def linear(x: NDArray, key: str) -> NDArray[np.float64]:
        return x @ get(key + ".weight").T + get(key + ".bias")

    def layer_norm(x: NDArray, key: str) -> NDArray[np.float64]:
        centred = x - x.mean(-1, keepdims=True)
        spread = np.sqrt((centred**2).mean(-1, keepdims=True) + 1e-12)
        return centred / spread * get(key + ".weight") + get(key + ".bias")

    words = get("embeddings.word_embeddings.weight")[token_ids]
    places = get("embeddings.position_embeddings.weight")[: len(token_ids)]
    x = layer_norm(words + places + get("embeddings.token_type_embeddings.weight")[0], "embeddings.LayerNorm")
    for layer in range(6):
        root = f"encoder.layer.{layer}."
        query, key, value = (linear(x, f"{root}attention.self.{part}") for part in ("query", "key", "value"))
        heads = []
        for head in range(12):
            part = slice(32 * head, 32 * head + 32)
            logits = query[:, part] @ key[:, part].T / math.sqrt(32)
            shares = np.exp(logits - logits.max(-1, keepdims=True))
            heads.append(shares / shares.sum(-1, keepdims=True) @ value[:, part])
        attended = linear(np.concatenate(heads, -1), root + "attention.output.dense")
        x = layer_norm(x + attended, root + "attention.output.LayerNorm")
        inner = linear(x, root + "intermediate.dense")
        inner = inner * 0.5 * (1 + erf(inner / math.sqrt(2)))
        x = layer_norm(x + linear(inner, root + "output.dense"), root + "output.LayerNorm")
    mean = x.mean(0)
    return mean / np.linalg.norm(mean)


def feature_cosine(weight_maps: Tensor, dictionary: Tensor, texts: Tensor) -> Tensor:
    """Cosines (P, ...) with the C-dimensional features formed at every pixel, float64."""
    features = weight_maps.double() @ dictionary.double()  # (..., C)
    norms = features.norm(dim=-1)
    cosines = (features @ texts.double().T).movedim(-1, 0) / norms
    return torch.where(norms == 0, 0.0, cosines)


def gram_cosine(weight_maps: Tensor, dictionary: Tensor, texts: Tensor) -> Tensor:
    """Cosines (P, ...) by the Gram matrix: W.(D t) / sqrt(W^T D D^T W), float64."""
    weights, atoms = weight_maps.double(), dictionary.double()
    squares = ((weights @ (atoms @ atoms.T)) * weights).sum(-1)
    dots = (weights @ (atoms @ texts.double().T)).movedim(-1, 0)
    return torch.where(squares <= 0, 0.0, dots / squares.clamp_min(1e-300).sqrt())


def softmax_relevancy(positives: Tensor, negatives: Tensor, temperature: float) -> Tensor:
    """LERF's relevancy as it is written: a softmax per negative, then the smallest, float64."""
    pairs = [
        torch.softmax(
            temperature * torch.stack((positives.double(), negative.double().expand_as(positives))), 0
        )[0]
        for negative in negatives
    ]
    return torch.stack(pairs).amin(0)


def beaten_twin(
    atom: NDArray[np.float64], phrase: NDArray[np.float64], names: NDArray[np.float64], constants: tuple
) -> float:
    """What rivals add to one atom's cosine with a phrase, name by name; constants: kin, behind, and of leads
    the offset and the direction."""
    kin, behind, offset, direction = constants
    length = math.sqrt(math.fsum(atom**2))
    if length == 0:
        return 0.0
    lead = offset + math.fsum(direction * phrase)
    own, ahead = math.fsum(atom * phrase) / length + lead, 0.0
    for name in names:
        if math.fsum(phrase * name) <= kin:
            other = math.fsum(atom * name) / length + offset + math.fsum(direction * name)
            ahead = max(ahead, other - own)
    return lead - behind * ahead
