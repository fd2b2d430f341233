"""What lives as long as the picture's size: colour, depth, weight maps, relevance, pictures to show."""

from collections.abc import Callable, Hashable, Sequence
from typing import Literal

import moderngl
import numpy as np

from .answers import Answers, MakeAnswers
from .blend import Blend
from .display import Display
from .fast import FastPasses
from .layered import Prepared
from .layout import PHRASES_A_LAYER, num_groups
from .packed import PackedMaps
from .painter import Painter
from .question import Question
from .targets import NUMPY_TYPES, ColourTarget, Layers, LayerTarget
from .weights import MakeMaps, Maps, WeightMaps


class ViewTargets:
    """Owns every texture of one picture size. Each knows by key what it shows and is drawn only for another.

    Several renderers may draw into the same: keys are given once, so none takes another's for its own.
    """

    def __init__(
        self,
        painter: Painter,
        size: tuple[int, int],
        dtype: str,
        map_dtype: str,
        make_maps: MakeMaps = WeightMaps,
    ):
        self.size = size
        self.colour = ColourTarget(painter.ctx, size, dtype)
        self.maps = make_maps(painter, size, map_dtype)
        self.packed = PackedMaps(painter, size)
        self.display = Display(painter, size, self.packed)
        self._painter = painter
        self._dtype = dtype
        self._shown = 0  # places in `colour`
        self._answers: dict[MakeAnswers, Answers] = {}
        self._fast: FastPasses | None = None
        self._blend: Blend | None = None
        self._brought = {kind: Layers(painter.ctx, size, "f4") for kind in ("told", "narrowed")}
        self._holds: dict[str, Hashable] = {}  # what of each kind

    def draw_colour(self, level: Prepared) -> None:
        """Colour and depth of the level as it stands, unless they are there."""
        if self._shown == level.places_key:
            return
        if level.weights is None:
            self._splat(level, self.colour.framebuffer)
        else:
            self._blended(level)
        self._shown = level.places_key

    def _splat(
        self,
        level: Prepared,
        into: moderngl.Framebuffer,
        numbers: np.ndarray | None = None,
        depth: bool = True,
    ) -> None:
        (part,) = level.parts
        part.splats.splat(into, numbers, depth)
        self._painter.passes["colour"] += 1

    def _blended(
        self, level: Prepared, numbers: Sequence[np.ndarray] = (), into: LayerTarget | None = None
    ) -> None:
        if self._blend is None:
            self._blend = Blend(self._painter, self.colour, self._dtype)
        self._blend.draw(level, numbers, into)

    def _shares(self, level: Prepared) -> moderngl.Texture | None:
        """What each part of a level that is blended counts in each pixel."""
        if level.weights is None:
            return None
        self.draw_colour(level)
        assert self._blend is not None
        return self._blend.shares

    def weight_maps(self, level: Prepared) -> Maps:
        """Those of the level as it stands, drawn unless they are there."""
        return self.maps.of(level, None if self.maps.shows(level) else self._shares(level))

    def colours(self, level: Prepared) -> np.ndarray:
        """(H, W, 3) uint8, the colour alone over black; what was drawn here before is gone."""
        self._shown = 0
        if level.weights is None:
            self._splat(level, self.colour.alone, depth=False)
        else:
            self._blended(level)
        width, height = self.size
        texels = self.colour.alone.read(components=3, alignment=1, dtype="f1")
        return np.frombuffer(texels, np.uint8).reshape(height, width, 3)

    def take(self, key: int, colour: np.ndarray, depth: np.ndarray) -> None:
        """Colour (H, W, 4) and depth (H, W, 2) of a picture drawn elsewhere, unless they are there."""
        if self._shown == key:
            return
        for texture, values in ((self.colour.colour, colour), (self.colour.depth, depth)):
            texture.write(np.ascontiguousarray(values, NUMPY_TYPES[texture.dtype]))
        self._shown = key

    def brought(
        self,
        kind: Literal["told", "narrowed"],
        name: Hashable,
        num_phrases: int,
        make: Callable[[], np.ndarray],
    ) -> LayerTarget:
        """Relevance (P, H, W) of this name that is made elsewhere, unless it is there: told in place of what
        is drawn here, or narrowed in place of what the picture answers."""
        layers = self._brought[kind].exactly(num_groups(num_phrases))
        if self._holds.get(kind) != name:
            width, height = self.size
            texels = np.zeros((layers.num_layers, height, width, PHRASES_A_LAYER), np.float32)
            for phrase, values in enumerate(make()):
                texels[phrase // PHRASES_A_LAYER, :, :, phrase % PHRASES_A_LAYER] = values
            layers.array.write(texels)
            self._holds[kind] = name
        return layers

    def exact(self, question: Question, level: Prepared) -> LayerTarget:
        """Relevance from the weight maps, which are drawn unless they are there."""
        return self.answers(question.answers).run(question.compiled, self.weight_maps(level))

    def fast(self, question: Question, level: Prepared) -> LayerTarget:
        """Relevance from numbers beside the colour: all three in one splat pass of each part, unless they are
        there."""
        passes = self.fast_passes(question.num_phrases)
        shown = (level.places_key, question.key)
        if passes.shows != shown:
            numbers = [question.numbers(part) for part in level.parts]
            if level.weights is None:
                self._splat(level, passes.framebuffer, numbers[0])
            else:
                self._blended(level, numbers, passes.numbers)
            self._shown, passes.shows = level.places_key, shown
            passes.run(question.compiled)
        return passes.relevance

    def answers(self, make: MakeAnswers) -> Answers:
        """Who answers so, over these targets; made once."""
        if make not in self._answers:
            self._answers[make] = make(self._painter, self.size, self.packed)
        return self._answers[make]

    def forget_answers(self) -> None:
        """The next question is answered from the weight maps alone, as the first of a view."""
        self.packed.forget()
        for answers in self._answers.values():
            answers.forget()

    def forget_maps(self) -> None:
        """Give the weight maps back, and pictures of single layers; whoever asks for them draws them anew."""
        self.maps.release()
        self.packed.forget()
        if self._blend is not None:
            self._blend.forget()

    def fast_passes(self, num_phrases: int) -> FastPasses:
        """What so many phrases are splatted into beside the colour; kept for the last number."""
        if self._fast is None or self._fast.num_phrases != num_phrases:
            self._release_fast()
            self._fast = FastPasses(self._painter, self.colour, self._dtype, num_phrases)
        return self._fast

    def _release_fast(self) -> None:
        if self._fast is not None:
            self._fast.release()
        self._fast = None

    def release(self) -> None:
        """Give every texture back."""
        for answers in self._answers.values():
            answers.release()
        self._answers.clear()
        self._release_fast()
        if self._blend is not None:
            self._blend.release()
        self._blend = None
        for owned in (*self._brought.values(), self.display, self.packed, self.maps, self.colour):
            owned.release()
