"""A still picture (still.py) as one of a renderer."""

from dataclasses import dataclass
from functools import partial

import moderngl
import numpy as np

from langflash_core.export.colours import heat

from ..display import Answer
from ..picture import Picture
from ..question import Question
from .still import Still, StillMaps, mixture


@dataclass(frozen=True)
class StillPicture(Picture):
    """What the last `bring` gave."""

    still: Still

    @property
    def depth_range(self) -> tuple[float, float]:
        return self.still.depth_range

    @property
    def maps(self) -> StillMaps:
        """Its weight maps.

        Raises:
            ValueError: nobody asked for them.
        """
        if self.still.maps is None:
            raise ValueError("bring: expected a picture with weight maps, received one without")
        return self.still.maps

    def lay(self) -> None:
        self.view.take(self.still.key, self.still.colour, self.still.depth)

    def weights(self, x: int, y: int) -> np.ndarray | None:
        return None if self.still.maps is None else self.maps.pixel(x, y)

    def read_maps(self) -> np.ndarray:
        return self.maps.weights.float().numpy()

    def answer(self, question: Question) -> Answer:
        maps = self.maps
        layers = self.view.told(self.still.key, question, lambda: maps.relevance(question.compiled))
        return Answer(layers, question.num_phrases, (self.drawn.key, question.key, False))

    def atoms(self) -> moderngl.Texture:
        return self._mixed("atoms", self.scene.atom_colours)

    def features(self) -> moderngl.Texture:
        return self._mixed("features", self.scene.feature_columns)

    def _mixed(self, kind: str, columns: np.ndarray) -> moderngl.Texture:
        make = partial(mixture, self.still, columns)
        return self.view.display.brought(kind, (self.still.key,), make)

    def weight(self, atom: int, colormap: str) -> moderngl.Texture:
        return self.view.display.brought(
            "weight",
            (self.still.key, atom, colormap),
            lambda: heat(self.maps.weights[..., atom], colormap).numpy(),
        )
