"""Language as others splat it, on the same Gaussians and rasteriser: all C channels, or few of which a
decoder makes C again at every pixel. N Gaussians, K atoms, C channels, d of them splatted.

Basis and decoder are fitted on the scene itself: more than a network for many scenes could know of it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from langflash_core.language.channels import Decoder
from langflash_core.language.relevance import CompiledQuery, feature_relevance
from langflash_core.types import Camera, Scene

from ..gl.processor.still import Still, StillMaps, draw_still

_EXAMPLES = 20_000
"""Gaussians that a decoder is fitted on."""


@dataclass(frozen=True)
class Channels:
    """What is splatted, (N, d) float32, and what makes vectors (n, C) of it at n pixels."""

    values: Tensor
    decode: Callable[[Tensor], Tensor]


@dataclass(frozen=True)
class DecodedMaps(StillMaps):
    """Maps of channels (H, W, d) float16, asked in all C numbers."""

    decode: Callable[[Tensor], Tensor] = torch.Tensor.float

    def relevance(self, compiled: CompiledQuery) -> np.ndarray:
        """(P, H, W) float32, decoded for every question anew."""
        single = replace(compiled, prompts=compiled.prompts.float(), negatives=compiled.negatives.float())
        return feature_relevance(self.weights, single, self.decode).numpy()


def channels_of(scene: Scene, count: int | None) -> Channels:
    """All channels of f_i = sum_k w_ik d_k, or `count` of them with a decoder."""
    vectors = scene.semantics.dense_weights().float() @ scene.semantics.dictionary.float()  # (N, C)
    if count is None or count >= vectors.shape[1]:
        return Channels(vectors, torch.Tensor.float)
    some = vectors[:: -(-len(vectors) // _EXAMPLES)]
    decoder = Decoder.fitted(some, count)
    return Channels(vectors @ decoder.basis.T, lambda coded: decoder(coded.float()))


def draw_channels(scene: Scene, channels: Channels, camera: Camera, threads: int) -> Still:
    """One picture, as `draw_still` draws it."""
    still = draw_still(scene, camera, carried=channels.values, threads=threads)
    assert still.maps is not None
    return replace(still, maps=DecodedMaps(still.maps.weights, decode=channels.decode))
