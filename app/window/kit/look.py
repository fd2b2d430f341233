"""What panels need besides the state: the interface's scale and the textures to show."""

from dataclasses import dataclass

import moderngl
from imgui_bundle import ImVec2

from .textures import Thumbnails


@dataclass(frozen=True)
class Look:
    """scale: interface pixels per design pixel. picture: the canvas, None before a scene."""

    scale: float
    picture: moderngl.Texture | None
    thumbnails: Thumbnails

    def px(self, design: float) -> float:
        """Interface pixels of a length given at scale 1."""
        return design * self.scale

    def vec(self, x: float, y: float) -> ImVec2:
        """A size or offset given at scale 1."""
        return ImVec2(x * self.scale, y * self.scale)
