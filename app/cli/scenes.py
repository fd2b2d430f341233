"""Scenes that a command is given, LangFlash's own files and splat files of other programs, what they are
taught before they are asked, and the camera."""

from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from langflash_core.base.files import readable_file
from langflash_core.errors import SceneFileError
from langflash_core.types import NO_LANGUAGE, Scene
from langflash_core.writing import cameras

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


def taught_by(path: Path | None) -> Callable[[Scene], Scene]:
    """What makes of a scene one that was taught by the vocabulary of `--words`; nothing changes without.

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


def chosen_camera(args: Namespace) -> cameras.CameraChoice:
    """That of `--view`, `--camera`, `--size` and `--ortho`.

    Raises:
        ViewError: the camera file cannot be used.
    """
    return cameras.chosen_camera(args.view, args.camera, args.size, bool(args.ortho))
