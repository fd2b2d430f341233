"""The network of a preset: which kind of geometry it has decides the class."""

from typing import overload

from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet
from langflash_core.network.pointmaps import PointMapNet
from langflash_core.network.presets import GuidedDepth, PointMaps, Preset

_KINDS = {GuidedDepth: GuidedDepthNet, PointMaps: PointMapNet}


def network_class(preset: Preset) -> type[GuidedDepthNet] | type[PointMapNet]:
    """What kind of network the preset describes.

    Raises:
        ValueError: the preset is of neither kind of geometry.
    """
    if type(preset) not in _KINDS:
        raise ValueError(f"preset: expected GuidedDepth or PointMaps, received {type(preset).__name__}")
    return _KINDS[type(preset)]


@overload
def build_network(preset: GuidedDepth) -> GuidedDepthNet: ...
@overload
def build_network(preset: PointMaps) -> PointMapNet: ...
@overload
def build_network(preset: Preset) -> LangFlashNet: ...
def build_network(preset: Preset) -> LangFlashNet:
    """A freshly drawn network."""
    return network_class(preset)(preset)  # type: ignore[arg-type]
