"""Optional packages, and the extra of LangFlash that brings each."""

from collections.abc import Iterator
from contextlib import contextmanager

from langflash_core.errors import MissingPackageError

EXTRAS = {
    "glfw": "window",
    "imgui_bundle": "window",
    "OpenGL": "window",
    "moderngl": "gl",
    "open_clip": "full",
    "torchvision": "full",
    "timm": "full",
    "matplotlib": "plots",
    "h5py": "photos",
    "skimage": "views",
    "OpenEXR": "views",
    "ray": "cluster",
    "tensorboard": "board",
    "transformers": "sam2",
    "pycolmap": "colmap",
    "anywidget": "notebook",
    "ai_edge_litert": "opinions",
}
"""Top-level import name -> extra in pyproject.toml."""


@contextmanager
def optional_packages() -> Iterator[None]:
    """Inside, importing an optional package that is not installed is an error with a remedy.

    Raises:
        MissingPackageError: names the extra that brings it.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        raise MissingPackageError(
            f"this needs the package {package}, which is not installed; "
            f"pip install 'langflash[{EXTRAS[package]}]' brings it"
        ) from error
