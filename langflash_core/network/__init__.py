"""Photos to a `Prediction`: encoder, geometry, Gaussians, language, grouping, aggregation.

The names below are read in at first use: what of this package needs no torch (`presets`,
`checkpoints.stored`) works before torch is there.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from langflash_core.network.build import build_network as build_network
    from langflash_core.network.checkpoints.files import initial_network as initial_network
    from langflash_core.network.checkpoints.files import load_network as load_network
    from langflash_core.network.checkpoints.files import save_network as save_network
    from langflash_core.network.guided import GuidedDepthNet as GuidedDepthNet
    from langflash_core.network.model import LangFlashNet as LangFlashNet
    from langflash_core.network.pointmaps import PointMapNet as PointMapNet
    from langflash_core.network.presets import FULL as FULL
    from langflash_core.network.presets import MINI as MINI
    from langflash_core.network.presets import PRESETS as PRESETS
    from langflash_core.network.presets import Preset as Preset

_HOMES = {
    "build_network": "build",
    "initial_network": "checkpoints.files",
    "load_network": "checkpoints.files",
    "save_network": "checkpoints.files",
    "GuidedDepthNet": "guided",
    "LangFlashNet": "model",
    "PointMapNet": "pointmaps",
    "FULL": "presets",
    "MINI": "presets",
    "PRESETS": "presets",
    "Preset": "presets",
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
