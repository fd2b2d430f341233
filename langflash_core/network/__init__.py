"""Photos to a `Prediction`: encoder, geometry, Gaussians, language, grouping, aggregation."""

from langflash_core.network.build import build_network
from langflash_core.network.checkpoints.files import initial_network, load_network, save_network
from langflash_core.network.guided import GuidedDepthNet
from langflash_core.network.model import LangFlashNet
from langflash_core.network.pointmaps import PointMapNet
from langflash_core.network.presets import FULL, MINI, PRESETS, Preset
from langflash_core.network.stereo.pairs import choose_pair

__all__ = [
    "FULL",
    "MINI",
    "PRESETS",
    "GuidedDepthNet",
    "LangFlashNet",
    "PointMapNet",
    "Preset",
    "build_network",
    "choose_pair",
    "initial_network",
    "load_network",
    "save_network",
]
