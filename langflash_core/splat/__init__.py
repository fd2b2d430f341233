"""Splatting Gaussians on the CPU in torch: the truth the OpenGL renderer is measured against."""

from .projection import NEAR, Footprints, project, view_colours, view_depths
from .reference import rasterize, render

__all__ = ["NEAR", "Footprints", "project", "rasterize", "render", "view_colours", "view_depths"]
