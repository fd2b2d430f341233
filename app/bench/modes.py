"""The modes that are compared: the default, and each of its decisions taken the other way."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Literal

from langflash_core.scene.thin import thin
from langflash_core.scene.weights import renormalise
from langflash_core.types import Scene


@dataclass(frozen=True)
class Mode:
    """One way of drawing: the default but for the fields named.

    axis: what is decided. name: how. precision: of the targets. kept: weights per Gaussian, None: all
    that the scene has. share: of the Gaussians, the others widened. fast: relevance from numbers
    splatted beside the colour. shrink: of the picture's sides.
    tiled: tile by tile, by compute shaders of OpenGL 4.3 (app/gl/tiled/).
    still: drawn on the processor, as the window does where OpenGL runs there too (app/gl/processor/still.py).
    colours: whether the picture's colours may differ from the default's, not its answers alone.
    """

    axis: str
    name: str
    precision: Literal["float16", "float32"] = "float16"
    kept: int | None = None
    share: float = 1.0
    fast: bool = False
    shrink: int = 1
    colours: bool = False
    still: bool = False
    tiled: bool = False

    def scene(self, scene: Scene) -> Scene:
        """The scene as this mode draws it: fewer Gaussians, or the largest weights of each, renormalised."""
        scene = thin(scene, self.share)
        semantics = scene.semantics
        if self.kept is None or self.kept >= semantics.weight_ids.shape[1]:
            return scene
        values, places = semantics.weight_values.topk(self.kept, dim=-1)
        kept = replace(
            semantics, weight_ids=semantics.weight_ids.gather(1, places), weight_values=renormalise(values)
        )
        return replace(scene, semantics=kept)


DEFAULT = Mode("default", "default")
MODES = (
    DEFAULT,
    Mode("precision", "float32", precision="float32", colours=True),
    Mode("relevance", "fast relevance", fast=True),
    Mode("weights", "m = 1", kept=1),
    Mode("weights", "m = 2", kept=2),
    Mode("weights", "m = 4", kept=4),
    Mode("weights", "m = 8", kept=8),
    Mode("resolution", "half resolution", shrink=2, colours=True),
    Mode("detail", "quarter of Gaussians", share=0.25, colours=True),
    Mode("rasteriser", "tiles by compute shaders", tiled=True, colours=True),
    Mode("rasteriser", "tiles on the processor", still=True, colours=True),
    Mode("rasteriser", "such tiles at half resolution", still=True, shrink=2, colours=True),
)
AXES = tuple(dict.fromkeys(mode.axis for mode in MODES[1:]))


def modes_for(scene: Scene, axes: Collection[str] = AXES, computes: bool = True) -> tuple[Mode, ...]:
    """The default first, then the modes of these axes that differ from it on this scene. computes: whether
    OpenGL has compute shaders."""
    stored = scene.semantics.weight_ids.shape[1]
    return DEFAULT, *(
        mode
        for mode in MODES[1:]
        if mode.axis in axes and (mode.kept is None or mode.kept < stored) and computes >= mode.tiled
    )


def described_default(scene: Scene) -> str:
    """What "default" means on this scene, in words."""
    stored = scene.semantics.weight_ids.shape[1]
    return (
        f"float16 targets, exact relevance, all {stored} weights per Gaussian, opacity-aware cut, "
        "reduced D, full resolution, fresh sort"
    )
