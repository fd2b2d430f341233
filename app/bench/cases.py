"""What is measured: a scene, the phrases asked, and the way of the camera."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch

from langflash_core.errors import InputError, PromptError
from langflash_core.language.relevance import CompiledQuery, compile_query, reduce_dictionary
from langflash_core.language.spaces import language_space
from langflash_core.types import Scene

from . import generated
from .paths import Path, camera_path

MAX_PHRASES = 16
PHRASES = ("plant", "floor", "window")
PAPER_GAUSSIANS, PAPER_ATOMS = 131_072, 128
PAPER_SIZES = ((988, 731), (1920, 1080))
SYNTHETIC_ATOMS = 24
SYNTHETIC_SIZE = (320, 240)


@dataclass(frozen=True)
class Case:
    """One table of the bench.

    compiled: phrases in the dictionary's r dimensions, float64; uncompiled: the same in all C
    (factor is D itself). notes: what of it was generated, one sentence each.
    """

    name: str
    scene: Scene
    path: Path
    compiled: CompiledQuery
    uncompiled: CompiledQuery
    notes: tuple[str, ...] = ()

    @property
    def size(self) -> tuple[int, int]:
        return self.path.cameras[0].width, self.path.cameras[0].height


def scene_case(
    name: str, scene: Scene, size: tuple[int, int] | None, num_frames: int, prompts: Sequence[str] | None
) -> Case:
    """A scene with its own dictionary and words.

    Raises:
        InputError: the scene has no Gaussians or no atoms.
        PromptError: more than 16 phrases, or one that cannot be asked.
    """
    _check_drawable(scene)
    if not scene.semantics.num_atoms:
        raise InputError("this scene has no atoms to query; add --atoms 64 to measure it with generated ones")
    texts = tuple(PHRASES if prompts is None else prompts)
    if len(texts) > MAX_PHRASES:
        raise PromptError(f"there are {len(texts)} phrases; give at most {MAX_PHRASES}")
    space = language_space(scene.semantics.space)
    return _case(name, scene, size, num_frames, compile_query(in_float64(scene), space, texts))


def generated_atoms_case(
    name: str, scene: Scene, num_atoms: int, size: tuple[int, int] | None, num_frames: int
) -> Case:
    """A scene without a dictionary, given one.

    Raises:
        InputError: the scene has no Gaussians, or has atoms of its own.
    """
    _check_drawable(scene)
    if scene.semantics.num_atoms:
        raise InputError(f"this scene has {scene.semantics.num_atoms} atoms of its own; leave --atoms out")
    with_atoms = generated.with_atoms(scene, num_atoms)
    query = generated.phrases(with_atoms, min(len(PHRASES), num_atoms))
    note = f"its {num_atoms} atoms, its weights and the phrases are generated, smooth over the scene"
    return _case(name, with_atoms, size, num_frames, query, (note,))


def synthetic_case(
    num_gaussians: int,
    num_atoms: int,
    size: tuple[int, int] | None,
    num_frames: int,
    num_phrases: int = len(PHRASES),
    spread: float = 1.0,
) -> Case:
    """A generated room."""
    chosen = size or SYNTHETIC_SIZE
    scene = generated.with_atoms(generated.room(num_gaussians, chosen, spread), num_atoms)
    query = generated.phrases(scene, min(num_phrases, num_atoms))
    notes = ("the scene, its dictionary and the phrases are generated",)
    if spread != 1.0:
        notes += (f"its Gaussians are {spread:g} times as wide as a network's",)
    return _case("generated room", scene, chosen, num_frames, query, notes)


def paper_cases(
    num_gaussians: int, num_atoms: int, size: tuple[int, int] | None, num_frames: int, spread: float
) -> list[Case]:
    """The paper's sizes, each with 1 and with 16 phrases; `size` replaces both sizes."""
    sizes = PAPER_SIZES if size is None else (size,)
    return [
        synthetic_case(num_gaussians, num_atoms, each, num_frames, count, spread)
        for each in sizes
        for count in (1, MAX_PHRASES)
    ]


def in_float64(scene: Scene) -> Scene:
    """The same scene for the reference: nothing is rounded on the way."""
    semantics = replace(
        scene.semantics,
        weight_values=scene.semantics.weight_values.double(),
        dictionary=scene.semantics.dictionary.double(),
    )
    return replace(scene, gaussians=scene.gaussians.map(torch.Tensor.double), semantics=semantics)


def _case(
    name: str,
    scene: Scene,
    size: tuple[int, int] | None,
    num_frames: int,
    compiled: CompiledQuery,
    notes: tuple[str, ...] = (),
) -> Case:
    path = camera_path(scene, size or scene.view_size, num_frames)
    dictionary = scene.semantics.dictionary.double()
    basis = reduce_dictionary(dictionary)[1]  # (r, C); what of a phrase leaves its span meets no F
    uncompiled = replace(
        compiled,
        factor=dictionary,
        prompts=compiled.prompts @ basis,
        negatives=compiled.negatives @ basis,
    )
    return Case(name, scene, path, compiled, uncompiled, notes)


def _check_drawable(scene: Scene) -> None:
    if not len(scene.gaussians):
        raise InputError("this scene has no Gaussians, so there is nothing to time; give another scene")
