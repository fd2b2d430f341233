"""Scenes that a command is given: LangFlash's own files, and splat files of other programs."""

from collections.abc import Sequence
from pathlib import Path

from langflash_core.base.files import readable_file
from langflash_core.errors import SceneFileError
from langflash_core.types import NO_LANGUAGE, Scene

from .report import say_warnings


def open_scene(path: Path, axes: str | None = None) -> Scene:
    """Read a scene; what a splat file left to guess or to leave out is said on stderr.

    Args:
        axes: as `export.read` takes them.

    Raises:
        SceneFileError: missing, damaged, or of a kind that this program does not read.
    """
    readable_file(path, "scene", SceneFileError)
    from langflash_core.export import read

    scene = read(path, axes=axes)
    if scene.semantics.space == NO_LANGUAGE:
        say_warnings(scene.record.warnings)
    return scene


def say_hints(scene: Scene, phrases: Sequence[str], *, narrowing: bool = True) -> None:
    """What people should know of phrases that a scene is asked, on stderr; narrowing: as `told`."""
    from langflash_core.language.spoken import phrase_notes

    say_warnings(hint for hint in dict.fromkeys(phrase_notes(scene, phrases, narrowing=narrowing)) if hint)
