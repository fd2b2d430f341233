"""Stages trained by their names alone."""

from collections.abc import Sequence
from pathlib import Path

from langflash_core.lab.training.commands import Encode, run_recipe
from langflash_core.lab.training.loop import LoopOptions
from langflash_core.lab.training.recipes import named_recipe
from langflash_core.network.model import LangFlashNet


def run_train(
    stages: Sequence[str],
    folder: Path,
    run_dir: Path,
    start: Path | None,
    encode: Encode,
    minutes: Sequence[float],
    *,
    preset: str = "mini",
    options: LoopOptions | None = None,
    from_scratch: bool = False,
) -> LangFlashNet:
    """`run_recipe` of these stages, each for its minutes."""
    recipe = named_recipe(stages, minutes, preset, options or LoopOptions(minutes=0))
    return run_recipe(recipe, folder, run_dir, start, encode, from_scratch=from_scratch)
