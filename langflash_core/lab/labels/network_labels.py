"""Our own network as proposer and namer: groups of a frame's pixels, and vectors of masks in its space.

Needs no weights but the shipped ones. Sizes: K groups, N masks, H W pixels of a frame, h w the network's.
"""

from collections.abc import Sequence

import cv2
import numpy as np
import torch
from jaxtyping import Bool, Float, UInt8
from torch import Tensor

from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.motion import views_of
from langflash_core.lab.labels.protocols import Proposals
from langflash_core.language.spaces import language_space
from langflash_core.network import LangFlashNet
from langflash_core.types import Prediction

_LEAST = 0.002  # of the frame's pixels in one piece of a group
_SHOWS = 0.1  # of a piece, where something is wanted: it may be the rest of what is known already


class NetworkGroups:
    """Each connected piece of each group is a mask; its score is the mean weight of its pixels."""

    def __init__(self, network: LangFlashNet) -> None:
        self._network = network

    def propose(
        self, image: UInt8[np.ndarray, "H W 3"], where: Bool[np.ndarray, "H W"] | None = None
    ) -> Proposals:
        """Pieces of the frame, which overlap nowhere; with `where`, those that reach into it."""
        predicted = self._network.predict(views_of(_still(image), (0,), (image,)))
        weights = predicted.weights[0].float().cpu().numpy()  # (K, h, w)
        masks, scores = [np.zeros((0, *image.shape[:2]), bool)], []
        if len(weights):
            large = np.stack([_resized(each, image) for each in weights])
            group = large.argmax(0)
            for k in range(len(large)):
                for piece in _pieces(group == k):
                    if where is None or where[piece].mean() > _SHOWS:
                        masks.append(piece[None])
                        scores.append(float(large[k][piece].mean()))
        return Proposals(np.concatenate(masks), np.array(scores, dtype=np.float64))


class NetworkNames:
    """Masks named by the network as it names its own groups: the encoder of the space it speaks."""

    def __init__(self, network: LangFlashNet) -> None:
        self._network = network
        self._space = language_space(network.preset.space)
        self.space, self.dimension = self._space.name, self._space.dimension

    def embed(
        self, image: UInt8[np.ndarray, "H W 3"], masks: Bool[np.ndarray, "N H W"]
    ) -> Float[Tensor, "N C"]:
        """Vectors of masks, all seen at once: names depend on what stands beside."""
        if len(masks) == 0:
            return torch.zeros(0, self.dimension)
        predicted = self._network.predict(
            views_of(_still(image), (0,), (image,)), groups=lambda found, views: _shares(masks, views.size)
        )
        return _unit(predicted)

    def texts(self, phrases: Sequence[str]) -> Float[Tensor, "P C"]:
        """Of the space's text tower."""
        return self._space.encode(phrases)


def _unit(predicted: Prediction) -> Tensor:
    return torch.nn.functional.normalize(predicted.dictionary.float().cpu(), dim=-1)


def _still(image: np.ndarray) -> Clip:
    return Clip("", ("frame",), lambda t: image)


def _resized(values: np.ndarray, image: np.ndarray) -> np.ndarray:
    return cv2.resize(values, (image.shape[1], image.shape[0]), interpolation=cv2.INTER_LINEAR)


def _pieces(mask: np.ndarray) -> list[np.ndarray]:
    count, parts, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    return [parts == n for n in range(1, count) if stats[n, cv2.CC_STAT_AREA] >= _LEAST * mask.size]


def _shares(masks: np.ndarray, size: tuple[int, int]) -> Tensor:
    """Masks at the network's size (width, height) as w_k(x), (1, N, h, w)."""
    small = [cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) for mask in masks]
    return torch.from_numpy(np.stack(small))[None]
