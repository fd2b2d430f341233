"""`--words FILE`: scenes take what a vocabulary says of such groups, before they are asked."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from langflash_core.types import Scene


def taught_by(path: Path | None) -> "Callable[[Scene], Scene]":
    """What makes of a scene one that was taught so; nothing changes without a vocabulary.

    Raises:
        PromptError: the vocabulary cannot be used.
    """
    if path is None:
        return lambda scene: scene
    from langflash_core.appearance import lessons_taken, own_network
    from langflash_core.language.lessons import read_lessons, with_lessons

    lessons, network = read_lessons(path), own_network()
    return lambda scene: replace(
        scene, record=with_lessons(scene.record, lessons_taken(scene, lessons, network))
    )
