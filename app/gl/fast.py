"""The fast mode: relevance while the camera moves, from a few numbers splatted beside the colour.

Exact relevance needs every weight map. Here each Gaussian carries its own answer instead: |f_i| and,
per phrase, g_i = f_i . t - max_n f_i . n (in cosine mode f_i . t). With W_i = T_i alpha_i, a pixel shows

    sum_i W_i g_i / sum_i W_i |f_i|   in place of   (F . t - max_n F . n) / |F|,

the same where the Gaussians of a pixel agree; where they do not, edges are a little softer. How much
that is on a scene, `langflash bench` says.
"""

import numpy as np

from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.settings import RELEVANCE

from .answers import in_numbers, temperature_of
from .layout import ATOMS_A_LAYER, LAYERS_A_PASS, PHRASES_A_LAYER, num_groups, num_layers
from .painter import Painter
from .splats import SplatBuffers
from .targets import ColourTarget, LayerTarget

MAX_PHRASES = ATOMS_A_LAYER * (LAYERS_A_PASS - 2) - 1
"""Colour and depth take two attachments, |f| one number of the rest."""


def splat_numbers(splats: SplatBuffers, compiled: CompiledQuery, norms: np.ndarray) -> np.ndarray:
    """|f_i| and g_i of every phrase, (N, 3 L) float32, filled up with zeros.

    Args:
        norms: |f_i| (N,).
    """
    factor, prompts, negatives = in_numbers(compiled)
    dots = splats.carried.mixed(factor @ np.concatenate((prompts, negatives)).T)  # (N, P + M)
    answers = dots[:, : len(prompts)]
    if compiled.mode == "relevancy":
        answers = answers - dots[:, len(prompts) :].max(1, keepdims=True)
    numbers = np.zeros((len(norms), ATOMS_A_LAYER * num_layers(1 + len(prompts))), np.float32)
    numbers[:, 0] = norms
    numbers[:, 1 : 1 + len(prompts)] = answers
    return numbers


class FastPasses:
    """Owns the layers that the numbers of so many phrases are splatted into, and the relevance made of them.

    numbers: the layers. framebuffer: these beside a target's colour and depth. Who draws into them says so in
    `shows`.
    """

    def __init__(self, painter: Painter, target: ColourTarget, dtype: str, num_phrases: int):
        size = target.colour.size
        self.num_phrases = num_phrases
        self.num_layers = num_layers(1 + num_phrases)
        self.relevance = LayerTarget(painter.ctx, size, num_groups(num_phrases), "f4")
        self.numbers = LayerTarget(painter.ctx, size, self.num_layers, dtype)
        self.framebuffer = self.numbers.layers(0, self.num_layers, beside=(target.colour, target.depth))
        self.shows: tuple[int, int] = (0, 0)  # places and question
        self._painter = painter

    def run(self, compiled: CompiledQuery) -> None:
        """Make `relevance` (4 phrases a layer, float32) of what was splatted last."""
        for group in range(self.relevance.num_layers):
            self._painter.fill(
                self.relevance.layers(group, 1),
                "fast.frag",
                {"numbers": self.numbers.array},
                {"first_phrase": PHRASES_A_LAYER * group, "temperature": temperature_of(compiled)},
                {"EMPTY_NORM": RELEVANCE.empty_norm},
            )

    def release(self) -> None:
        self.relevance.release()
        self.numbers.release()
