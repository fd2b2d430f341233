"""The fast mode: relevance while the camera moves, from a few numbers splatted beside the colour.

Exact relevance needs every weight map. Here each Gaussian carries its own answer instead: |f_i| and,
per phrase, g_i = f_i . t - max_n f_i . n (in cosine mode f_i . t). With W_i = T_i alpha_i, a pixel shows

    sum_i W_i g_i / sum_i W_i |f_i|   in place of   (F . t - max_n F . n) / |F|,

the same where the Gaussians of a pixel agree; where they do not, edges are a little softer. How much
that is on a scene, `langflash bench` says.
"""

import moderngl
import numpy as np

from langflash_core.language.relevance import EMPTY_NORM, CompiledQuery

from .combine import PHRASES, Screen
from .programs import Programs, set_uniforms
from .splats import SplatBuffers
from .targets import ColourTarget, LayerTarget, drawing

NUMBERS = 3  # a layer
MAX_LAYERS = 6  # colour and depth take two of eight attachments
MAX_PHRASES = NUMBERS * MAX_LAYERS - 1


def splat_numbers(splats: SplatBuffers, compiled: CompiledQuery, norms: np.ndarray) -> np.ndarray:
    """|f_i| and g_i of every phrase, (N, 3 L) float32, filled up with zeros.

    Args:
        norms: |f_i| (N,), of `splat_norms`.
    """
    factor = compiled.factor.detach().cpu().double().numpy()
    prompts = compiled.prompts.detach().cpu().double().numpy()
    negatives = compiled.negatives.detach().cpu().double().numpy()
    dots = splats.mixed(factor @ np.concatenate((prompts, negatives)).T)  # (N, P + M)
    answers = dots[:, : len(prompts)]
    if compiled.mode == "relevancy":
        answers = answers - dots[:, len(prompts) :].max(1, keepdims=True)
    numbers = np.zeros((len(norms), NUMBERS * num_layers(len(prompts))), np.float32)
    numbers[:, 0] = norms
    numbers[:, 1 : 1 + len(prompts)] = answers
    return numbers


def splat_norms(splats: SplatBuffers, factor: np.ndarray) -> np.ndarray:
    """|f_i| (N,) of Gaussians over a dictionary with factor R (K, r)."""
    return np.linalg.norm(splats.mixed(factor), axis=1)


def num_layers(num_phrases: int) -> int:
    """Layers that |f| and so many phrases fill."""
    return -(-(1 + num_phrases) // NUMBERS)


class FastPasses:
    """Owns the layers that the numbers are splatted into, and the relevance made of them."""

    def __init__(
        self,
        ctx: moderngl.Context,
        programs: Programs,
        screen: Screen,
        target: ColourTarget,
        compiled: CompiledQuery,
        dtype: str,
    ):
        self._programs = programs
        self._screen = screen
        self._num_phrases = len(compiled.prompts)
        self._numbers = LayerTarget(ctx, target.colour.size, num_layers(self._num_phrases), dtype)
        groups = -(-self._num_phrases // PHRASES)
        self.relevance = LayerTarget(ctx, target.colour.size, groups, "f4")
        self.framebuffer = self._numbers.layers(
            0, self._numbers.num_layers, beside=(target.colour, target.depth)
        )

    def fits(self, compiled: CompiledQuery) -> bool:
        """Whether the layers serve so many phrases; of another number they are made anew."""
        return len(compiled.prompts) == self._num_phrases

    def run(self, compiled: CompiledQuery) -> LayerTarget:
        """Relevance (4 phrases a layer, float32) of what was splatted last."""
        temperature = float(compiled.temperature) if compiled.mode == "relevancy" else 0.0
        program = self._programs.get("screen.vert", "fast.frag", {"EMPTY_NORM": EMPTY_NORM})
        self._numbers.array.use(0)
        for group in range(self.relevance.num_layers):
            set_uniforms(program, numbers=0, first_phrase=PHRASES * group, temperature=temperature)
            with drawing(self.relevance.layers(group, 1)):
                self._screen.draw(program)
        return self.relevance

    def release(self) -> None:
        self.relevance.release()
        self._numbers.release()
