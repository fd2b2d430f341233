"""LangFlash: unposed photos to a 3D Gaussian scene that answers words."""

__version__ = "0.1.0"
