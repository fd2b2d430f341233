"""A prediction becomes a scene: assembled, pruned to what it needs, kept in one file."""

from langflash_core.scene.assemble import assemble
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.file import load, save
from langflash_core.scene.prune import prune
from langflash_core.scene.report import describe
from langflash_core.scene.thin import thin

__all__ = ["assemble", "bare_scene", "describe", "load", "prune", "save", "thin"]
