"""Relevance on the processor, where the graphics card is one too.

A software rasteriser (llvmpipe) runs shaders on the same cores that numpy uses, only slower: the products
of a phrase with 24 weight maps at 640 x 480 take it some 11 ms, numpy 2 ms on the same machine. So there
the weight maps are read back once a view, which is a copy within memory, and a phrase is one
vector-matrix product and a handful of element-wise operations. On a graphics card the shaders of
answers.py do the same without the maps leaving it.
"""

import numpy as np

from langflash_core.language.settings import RELEVANCE

from ..answers import Answers
from ..layout import ATOMS_A_LAYER, PHRASES_A_LAYER
from ..targets import NUMPY_TYPES, LayerTarget
from ..weights import Maps

_LARGEST_EXPONENT = np.float32(80)  # exp of it is finite in float32, and 1 / (1 + exp) is 0 to all digits


class HostAnswers(Answers):
    """By numpy over weight maps that were read back; float32.

    Steps kept: the maps (per view), 1 / |F| (per dictionary), the largest negative's cosine (per set of
    negatives), relevance (per prompts). Pixels lie along the second axis: (n, H W).
    """

    _version = 0  # of the maps
    _maps: np.ndarray  # (Ka, H W)
    _inverse_norms: np.ndarray  # (H W,), 0 where empty
    _worst: np.ndarray  # (H W,), infinite where empty

    def measure(self, maps: Maps, factor: np.ndarray) -> None:
        if maps.version != self._version:
            self._maps, self._version = read_maps(maps), maps.version
        self._inverse_norms = inverse_norms(self._maps, factor)

    def scale(self, maps: Maps, dots: np.ndarray) -> None:
        self._worst = np.full(self._maps.shape[1], -1.0, np.float32)
        for column in dots.T:
            np.maximum(self._worst, self._cosine(column), out=self._worst)
        self._worst[self._inverse_norms == 0] = np.inf

    def _cosine(self, column: np.ndarray) -> np.ndarray:
        cosine = column.astype(np.float32) @ self._maps
        cosine *= self._inverse_norms
        return np.clip(cosine, -1, 1, out=cosine)

    def compare(self, maps: Maps, dots: np.ndarray, temperature: float, into: LayerTarget) -> None:
        width, height, _ = into.array.size
        for group in range(into.num_layers):
            texels = np.zeros((width * height, PHRASES_A_LAYER), np.float32)
            for place, column in enumerate(dots.T[PHRASES_A_LAYER * group :][:PHRASES_A_LAYER]):
                value = self._cosine(column)
                if temperature > 0:
                    value = relevancy(value, self._worst, temperature)
                texels[:, place] = value
            into.array.write(texels, viewport=(0, 0, group, width, height, 1))

    def forget(self) -> None:
        super().forget()
        self._version = 0


def read_maps(maps: Maps) -> np.ndarray:
    """The weight maps of the atoms in view as (Ka, H W) float32."""
    width, height, num_layers = maps.array.size
    texels = np.frombuffer(maps.array.read(), NUMPY_TYPES[maps.array.dtype]).reshape(
        num_layers, height * width, 4
    )
    read = np.empty((len(maps.atoms), height * width), np.float32)
    for place in range(len(read)):
        read[place] = texels[place // ATOMS_A_LAYER, :, place % ATOMS_A_LAYER]
    return read


def inverse_norms(maps: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """1 / |W R| (H W,) float32 of maps (Ka, H W) and R (Ka, r); 0 where |W R| is below
    `RELEVANCE.empty_norm`."""
    squares = np.zeros(maps.shape[1], np.float32)
    # R = L Q with triangular L: column j needs no atom before j.
    triangular = np.asarray(np.linalg.qr(factor.T, mode="r")).T.astype(np.float32)
    for column in range(triangular.shape[1]):
        part = triangular[column:, column] @ maps[column:]
        squares += np.square(part, out=part)
    norms = np.sqrt(squares, out=squares)
    return np.divide(1, norms, out=np.zeros_like(norms), where=norms >= RELEVANCE.empty_norm)


def relevancy(cosines: np.ndarray, worst: np.ndarray, temperature: float) -> np.ndarray:
    """1 / (1 + exp(temperature (worst - cosine))), in place; 0 where `worst` is infinite."""
    np.subtract(worst, cosines, out=cosines)
    cosines *= np.float32(temperature)
    empty = cosines == np.inf
    np.clip(cosines, -_LARGEST_EXPONENT, _LARGEST_EXPONENT, out=cosines)
    np.exp(cosines, out=cosines)
    cosines += 1
    np.reciprocal(cosines, out=cosines)
    cosines[empty] = 0
    return cosines
