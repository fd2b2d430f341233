"""Photos to a `Prediction`: encoder, guided depth, Gaussians, language, grouping, aggregation."""

from langflash_core.network.checkpoints import initial_network, load_network, save_network
from langflash_core.network.model import STAGES, LangFlashNet
from langflash_core.network.pairs import choose_pair
from langflash_core.network.presets import MINI, PRESETS, Preset

__all__ = [
    "MINI",
    "PRESETS",
    "STAGES",
    "LangFlashNet",
    "Preset",
    "choose_pair",
    "initial_network",
    "load_network",
    "save_network",
]
