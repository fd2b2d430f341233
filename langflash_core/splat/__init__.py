"""Splatting Gaussians on the CPU in torch: the truth the OpenGL renderer is measured against."""

from .compose import render
from .projection import NEAR, Footprints, drawable_rows, project, view_colours, view_depths
from .reference import rasterize

__all__ = [
    "NEAR",
    "Footprints",
    "drawable_rows",
    "project",
    "rasterize",
    "render",
    "view_colours",
    "view_depths",
]
