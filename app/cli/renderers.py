"""The two ways to draw a frame: the window's own GL renderer, and the torch reference of the core."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from langflash_core.base.optional import optional_packages
from langflash_core.errors import GraphicsError, MissingPackageError
from langflash_core.types import Camera, Frame, Scene
from langflash_core.writing.renderers import Renderer, Shown, TorchRenderer

from .report import say_warnings

if TYPE_CHECKING:
    import numpy as np
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery


class GlRenderer:
    """The window's renderer on an offscreen context; `release()` gives both back.

    Raises:
        GraphicsError: there is no OpenGL 3.3 on this machine.
        MissingPackageError: the packages that speak OpenGL are not installed.
    """

    backend = "gl"

    def __init__(self) -> None:
        with optional_packages():
            from ..gl import SplatRenderer, offscreen_context

        self._context = offscreen_context()
        with self._current():
            self._splats = SplatRenderer(self._context)
        self._scene: Scene | None = None
        self._asked: CompiledQuery | None = None

    def __call__(self, scene: Scene, camera: Camera, *, weight_maps: bool = True) -> Frame:
        with self._current():
            self._show(scene)
            self._splats.draw(camera, weight_maps=weight_maps)
            return self._splats.frame(weight_maps=weight_maps)

    def colours(
        self, scene: Scene, camera: Camera, *, fade: bool = False, fill: bool = False
    ) -> "np.ndarray":
        from langflash_core.scene.trust import check_photos

        if fade:
            check_photos(scene)
        with self._current():
            self._show(scene)
            return self._splats.colours(camera, fade=fade, fill=fill)

    def answered(self, scene: Scene, camera: Camera, compiled: "CompiledQuery") -> "tuple[Frame, Tensor]":
        with self._current():
            self._show(scene)
            if compiled is not self._asked:
                self._splats.ask(compiled)
                self._asked = compiled
            self._splats.draw(camera, weight_maps=False, fast=True)
            return self._splats.frame(), self._splats.relevance()

    @contextmanager
    def _current(self) -> Iterator[None]:
        """The context is the one in use, since another renderer's may have been; what its driver refuses is
        a sentence."""
        from langflash_core.base.graphics import refusals_said

        with self._context, refusals_said(self._context, "try a smaller --size, or --backend torch"):
            yield

    def _show(self, scene: Scene) -> None:
        if scene is not self._scene:
            self._splats.set_scene(scene)
            self._scene, self._asked = scene, None

    def release(self) -> None:
        """Give the context back."""
        with self._context:
            self._splats.release()
        self._context.release()


@contextmanager
def open_renderer(
    backend: "str | Renderer | None", *, fade: bool = False, fill: bool = False
) -> Iterator[Renderer]:
    """A renderer for the length of a command; `fade`, `fill`: as `Shown`.

    Args:
        backend: "gl", "torch", or None: gl, and torch with a warning where OpenGL or what speaks it is
            missing. A renderer is taken as it is, and stays open.

    Raises:
        GraphicsError, MissingPackageError: "gl" was asked for and is not there.
    """
    if fade or fill:
        with open_renderer(backend) as inner:
            yield Shown(inner, fade=fade, fill=fill)
        return
    if backend is not None and not isinstance(backend, str):
        yield backend
        return
    if backend == "torch":
        yield TorchRenderer()
        return
    try:
        renderer = GlRenderer()
    except (GraphicsError, MissingPackageError) as problem:
        if backend == "gl":
            raise GraphicsError(f"{problem}, or use --backend torch") from problem
        say_warnings([f"{str(problem).rstrip('.')}; drawing with the slow torch reference instead"])
        yield TorchRenderer()
        return
    try:
        yield renderer
    finally:
        renderer.release()
