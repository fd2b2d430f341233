"""The splat renderer in OpenGL 3.3, in a window or without one."""

from langflash_core.base.graphics import offscreen_context

from .processor.moving import moving_renderer
from .renderer import SplatRenderer

__all__ = ["SplatRenderer", "moving_renderer", "offscreen_context"]
