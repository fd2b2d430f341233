"""Who draws frames: the torch reference, or a renderer of the program's, which a caller brings; and either
with pictures made for people."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from langflash_core.types import Camera, Frame, Scene

if TYPE_CHECKING:
    import numpy as np
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery


@runtime_checkable
class Renderer(Protocol):
    """Draws scenes. `backend` is "gl" or "torch"."""

    backend: str

    def __call__(self, scene: Scene, camera: Camera, *, weight_maps: bool = True) -> Frame: ...

    def colours(
        self, scene: Scene, camera: Camera, *, fade: bool = False, fill: bool = False
    ) -> "np.ndarray":
        """(H, W, 3) uint8, for pictures that move: gl reads nothing else back. fade, fill: as `Shown`."""
        ...

    def answered(self, scene: Scene, camera: Camera, compiled: "CompiledQuery") -> "tuple[Frame, Tensor]":
        """A frame and relevance (P, H, W), for pictures that move: gl answers as the moving window does."""
        ...


class TorchRenderer:
    """The reference rasteriser: slow, exact."""

    backend = "torch"

    def __call__(self, scene: Scene, camera: Camera, *, weight_maps: bool = True) -> Frame:
        from langflash_core.splat import render

        return render(scene, camera, weight_maps=weight_maps)

    def colours(
        self, scene: Scene, camera: Camera, *, fade: bool = False, fill: bool = False
    ) -> "np.ndarray":
        from langflash_core.export.png import to_8bit

        frame = self(scene, camera, weight_maps=False)
        return to_8bit(_show_frame(frame, scene, camera, fade=fade, fill=fill).rgb)

    def answered(self, scene: Scene, camera: Camera, compiled: "CompiledQuery") -> "tuple[Frame, Tensor]":
        from langflash_core.language.relevance import relevance_maps

        frame = self(scene, camera)
        assert frame.weight_maps is not None
        return frame, relevance_maps(frame.weight_maps, compiled)


class Shown:
    """A renderer whose pictures are for people: they fade where no photo looked from about there
    (`scene.trust`), and their gaps are filled (`scene.gaps`)."""

    def __init__(self, inner: Renderer, *, fade: bool, fill: bool) -> None:
        self.inner, self.backend = inner, inner.backend
        self._fade, self._fill = fade, fill

    def __call__(self, scene: Scene, camera: Camera, *, weight_maps: bool = True) -> Frame:
        frame = self.inner(scene, camera, weight_maps=weight_maps)
        return _show_frame(frame, scene, camera, fade=self._fade, fill=self._fill)

    def colours(
        self, scene: Scene, camera: Camera, *, fade: bool = False, fill: bool = False
    ) -> "np.ndarray":
        return self.inner.colours(scene, camera, fade=fade or self._fade, fill=fill or self._fill)

    def answered(self, scene: Scene, camera: Camera, compiled: "CompiledQuery") -> "tuple[Frame, Tensor]":
        frame, relevance = self.inner.answered(scene, camera, compiled)
        shown = _show_frame(frame, scene, camera, fade=self._fade, fill=self._fill)
        return shown, relevance * (shown.alphas > 0) if self._fade else relevance


def _show_frame(frame: Frame, scene: Scene, camera: Camera, *, fade: bool, fill: bool) -> Frame:
    from langflash_core.scene.gaps import fill_gaps
    from langflash_core.scene.trust import fade_untrusted

    shown = fade_untrusted(frame, camera, scene) if fade else frame
    return replace(shown, rgb=fill_gaps(shown.rgb, frame.alphas)) if fill else shown


@contextmanager
def torch_renderer() -> Iterator[Renderer]:
    """The reference, for the length of a `with`."""
    yield TorchRenderer()
