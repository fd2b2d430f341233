"""A scene in a cell of a notebook: its page, and with the package anywidget what happens there comes back
to Python.

    shown = scene.show("plant")     # a cell
    shown.answers                   # [{"phrase": "plant", "found": True, "score": 0.97}] of the view on show
    lf.query(scene, "chair", camera=shown.view())
    shown.asked, shown.go = "window", {"stop": "The door"}

The page is in an iframe that may run its own program and nothing else; widget.js carries its messages, which
export/page/embedding.js describes.
"""

import html
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import torch

from langflash_core import pipeline
from langflash_core.types import Camera, Scene

HEIGHT = 560  # pixels
_PROGRAM = Path(__file__).with_name("widget.js")


class Cell:
    """A page that a notebook shows, and tells nothing of."""

    def __init__(self, page: str, height: int):
        self.page, self.height = page, height

    def _repr_html_(self) -> str:
        style = f"width: 100%; height: {self.height}px; border: 0"
        source = html.escape(self.page, quote=True)
        return f'<iframe sandbox="allow-scripts" title="a scene" style="{style}" srcdoc="{source}"></iframe>'


def show(
    scene: Scene,
    prompts: Sequence[str] | str = (),
    *,
    height: int = HEIGHT,
    detail: str = "normal",
    title: str = "scene",
) -> Any:
    """The scene for a cell of a notebook.

    Args:
        prompts: phrases that are asked from the start. height: pixels. detail: "normal", or "low" for the
            coarse Gaussians alone.

    Returns:
        A widget; without the package anywidget (`pip install 'langflash[notebook]'`) a `Cell`.

    Raises:
        PromptError: a prompt cannot be used. OutputError: the scene holds no Gaussians.
    """
    page = page_of(scene, [prompts] if isinstance(prompts, str) else prompts, detail=detail, title=title)
    widget = _widget()
    return Cell(page, height) if widget is None else widget(page=page, height=height)


def page_of(scene: Scene, prompts: Sequence[str], *, detail: str, title: str) -> str:
    """The page as a text; as `pipeline.web_page`."""
    from langflash_core.scene.thin import coarse_level

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.html"
        shown = coarse_level(scene) if detail == "low" else scene
        pipeline.web_page(shown, path, prompts, title=title)
        return path.read_text(encoding="utf-8")


@cache
def _widget() -> type | None:
    """The widget's class; None where anywidget is not installed."""
    try:
        import anywidget  # pyright: ignore[reportMissingImports]
        import traitlets  # pyright: ignore[reportMissingImports]
    except ModuleNotFoundError:
        return None

    class Shown(anywidget.AnyWidget):
        """A scene on show. camera: as `langflash render --camera` reads it; setting it flies there.
        answers: to the phrases on the page, of the view on show. stop: the last one of the tour. asked: set
        it to ask. go: set it to {"stop": name}, {"view": number} or {"camera": ...}. ready: there is a
        picture."""

        _esm = _PROGRAM
        page = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int(HEIGHT).tag(sync=True)
        ready = traitlets.Bool(False).tag(sync=True)
        camera = traitlets.Dict().tag(sync=True)
        answers = traitlets.List().tag(sync=True)
        stop = traitlets.Unicode().tag(sync=True)
        asked = traitlets.Unicode().tag(sync=True)
        go = traitlets.Dict().tag(sync=True)

        def view(self) -> Camera | None:
            """The camera on show, for `query`; None before there is a picture."""
            return camera_from(self.camera) if self.camera else None

    return Shown


def camera_from(said: dict[str, Any]) -> Camera:
    """A camera as the page tells it."""
    viewmat, K = (torch.tensor(said[name], dtype=torch.float32) for name in ("viewmat", "K"))
    return Camera(viewmat, K, int(said["width"]), int(said["height"]))
