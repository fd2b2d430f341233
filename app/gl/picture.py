"""A picture of a renderer: what it shows, how its numbers are read, what can be asked of it.

Two kinds: `DrawnPicture`, drawn by OpenGL, and `StillPicture`, drawn elsewhere (processor/still.py) and
brought.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import partial

import moderngl
import numpy as np
import torch

from langflash_core.export.colours import heat
from langflash_core.splat.projection import ALPHA_MIN
from langflash_core.types import Frame

from .display import Answer, Drawn
from .layered import Prepared
from .processor.still import Still, StillMaps, mixture
from .question import Question
from .scene import LiveScene
from .targets import mean_depths, read
from .view import ViewTargets
from .weights import Maps


@dataclass(frozen=True)
class Picture(ABC):
    """Of a scene, on targets that other renderers may draw on too."""

    scene: LiveScene
    view: ViewTargets
    drawn: Drawn

    @property
    @abstractmethod
    def depth_range(self) -> tuple[float, float]:
        """Depths of the middle 96 % of the Gaussians in view, scene units."""

    @abstractmethod
    def lay(self) -> None:
        """Colour and depth onto the targets again, where another renderer drew since."""

    @abstractmethod
    def weights(self, x: int, y: int) -> np.ndarray | None:
        """(K,) of a pixel, once the weight maps are there."""

    @abstractmethod
    def read_maps(self) -> np.ndarray:
        """(H, W, K) float32."""

    @abstractmethod
    def answer(self, question: Question) -> Answer:
        """Relevance of phrases."""

    @abstractmethod
    def atoms(self) -> moderngl.Texture:
        """Every atom in its own colour."""

    @abstractmethod
    def features(self) -> moderngl.Texture:
        """Principal axes of the features as colours."""

    @abstractmethod
    def weight(self, atom: int, colormap: str) -> moderngl.Texture:
        """One atom's weight map."""

    def frame(self, weight_maps: bool) -> Frame:
        """As tensors on the CPU, float32."""
        width, height = self.view.size
        colour = read(self.drawn.target.colour).reshape(height, width, 4)
        sums = read(self.drawn.target.depth).reshape(height, width, 2)
        alphas, depths = sums[..., 1].copy(), mean_depths(sums, ALPHA_MIN)
        maps = torch.from_numpy(self.read_maps()) if weight_maps else None
        under = np.asarray(self.drawn.background, np.float32)
        rgb = torch.from_numpy(colour[..., :3] + (1 - alphas[..., None]) * under)
        return Frame(rgb, torch.from_numpy(alphas), torch.from_numpy(depths), maps)

    def pixel(self, x: int, y: int) -> tuple[float, float, np.ndarray | None]:
        """Alpha, depth and weights of one pixel, as `SplatRenderer.pixel`."""
        content = self.drawn.target.framebuffer.read((x, y, 1, 1), 2, attachment=1, dtype="f4")
        total, alpha = np.frombuffer(content, np.float32).tolist()
        depth = total / alpha if alpha >= ALPHA_MIN else 0.0
        return alpha, depth, self.weights(x, y)


@dataclass(frozen=True)
class DrawnPicture(Picture):
    """What the last `draw` asked for, of a level as it stood then."""

    level: Prepared
    fast: bool
    span: tuple[float, float]

    @property
    def depth_range(self) -> tuple[float, float]:
        return self.span

    def lay(self) -> None:
        self.view.draw_colour(self.level)

    @property
    def maps(self) -> Maps:
        """Its weight maps, drawn unless they are there."""
        return self.view.weight_maps(self.level)

    def weights(self, x: int, y: int) -> np.ndarray | None:
        there = self.view.maps.shows(self.level)
        return self.maps.pixel(x, y, self.scene.num_atoms) if there else None

    def read_maps(self) -> np.ndarray:
        return self.maps.read(self.scene.num_atoms)

    def answer(self, question: Question) -> Answer:
        """From the fast mode or else from weight maps: those that are there are better."""
        fast = self.fast and question.fits_fast and not self.view.maps.shows(self.level)
        layers = (self.view.fast if fast else self.view.exact)(question, self.level)
        return Answer(layers, question.num_phrases, (self.drawn.key, question.key, fast))

    def atoms(self) -> moderngl.Texture:
        return self.view.display.atoms(self.maps, self.scene.atom_colours)

    def features(self) -> moderngl.Texture:
        return self.view.display.features(self.maps, self.scene.feature_columns)

    def weight(self, atom: int, colormap: str) -> moderngl.Texture:
        return self.view.display.weight(self.maps, atom, colormap)


@dataclass(frozen=True)
class StillPicture(Picture):
    """What the last `bring` gave: a still picture as one of a renderer."""

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
        name = self.still.key, question.key
        layers = self.view.brought(
            "told", name, question.num_phrases, lambda: maps.relevance(question.compiled)
        )
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
