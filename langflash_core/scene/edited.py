"""The scene that edits describe: what phrases are asked of, and what is saved."""

from collections.abc import Sequence
from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.scene.changed import changed_scene
from langflash_core.scene.edits import Atom, Marks
from langflash_core.types import NO_LANGUAGE, Scene, Semantics

RECORDED = ("camera_path", "metric_scale", "tour", "world", "thing_names")
"""What marks and a scene's record both say."""


def edited_dictionary(scene: Scene, atoms: Sequence[Atom]) -> Float[Tensor, "K C"]:
    """The dictionary (K, C) after merging: merged atoms share one row, silent ones are 0.

    Two rows d are one atom with the sum of the weights: W_a d + W_b d = (W_a + W_b) d. So a query
    of these rows over unchanged weight maps is exact, and nothing is drawn again.
    The shared row is the mean by mass, the opacity that carries each atom, at unit norm.
    """
    dictionary = scene.semantics.dictionary
    if not len(atoms):
        return dictionary
    heads = torch.tensor([atom.into for atom in atoms])
    masses = _masses(scene)[:, None]
    sums = torch.zeros_like(dictionary).index_add(0, heads, masses * dictionary)
    alone = (torch.bincount(heads, minlength=len(atoms)) == 1)[heads]
    cancelled = sums.norm(dim=-1) < 1e-6  # no mass, or opposites: the head's own direction stays
    shared = torch.where(cancelled[:, None], dictionary, normalize(sums, dim=-1))[heads]
    rows = torch.where(alone[:, None], dictionary, shared)
    return torch.where(torch.tensor([atom.on for atom in atoms])[:, None], rows, 0.0)


def spoken_scene(scene: Scene, marks: Marks) -> Scene:
    """The scene with its edited dictionary: for queries, cheap, every Gaussian still in its row."""
    if marks.atoms == atoms_of(scene):
        return scene
    semantics = replace(scene.semantics, dictionary=edited_dictionary(scene, marks.atoms))
    spoken = replace(scene, semantics=semantics)
    return spoken.with_record(
        atom_names={k: atom.name for k, atom in enumerate(marks.atoms) if atom.name},
        atom_denials={k: atom.denied for k, atom in enumerate(marks.atoms) if atom.denied},
        silent_atoms=tuple(k for k, atom in enumerate(marks.atoms) if not atom.on),
    )


def edited_scene(scene: Scene, marks: Marks) -> Scene:
    """The scene to save: its Gaussians moved and recoloured, without deleted ones; merged atoms as one;
    names, key frames, tour, scale and where it stands in its record.

    Hidden Gaussians are kept. Untouched marks give back the scene itself.
    """
    scene = there(changed_scene(scene, marks), marks)
    some_unknown = scene.view_ids is not None and bool((scene.view_ids < 0).any())
    if some_unknown and not scene.layered:  # layers are told by them
        scene = replace(scene, view_ids=None)
    marks = marks.of_size(len(scene.gaussians), marks.atoms[: marks.there[1]])
    record = scene.record
    told = {name: getattr(marks, name) for name in RECORDED}
    if any(value != getattr(record, name) for name, value in told.items()):
        scene = scene.with_record(**told)
    if not marks.deleted and marks.atoms == atoms_of(scene):
        return scene
    joined = _merge_atoms(scene, marks.atoms)
    deleted = scene.record.num_deleted + len(marks.deleted)
    return without_deleted(joined, marks).with_record(num_deleted=deleted)


def without_deleted(scene: Scene, marks: Marks) -> Scene:
    """The scene without deleted Gaussians; its atoms and its record as they are."""
    kept = marks.left
    return scene if len(kept) == kept.count else scene.rows(torch.from_numpy(kept.rows()))


def there(scene: Scene, marks: Marks) -> Scene:
    """The scene without what a merge brought that was undone."""
    num_gaussians, num_atoms = marks.there
    if marks.there == (len(scene.gaussians), scene.semantics.num_atoms):
        return scene
    first = _first(scene, num_gaussians)
    semantics = first.semantics
    if num_atoms:
        semantics = replace(semantics, dictionary=semantics.dictionary[:num_atoms])
    else:  # a splat file, into which a scene with language was merged
        none = semantics.weight_ids[:, :0], semantics.weight_values[:, :0]
        semantics = Semantics(*none, semantics.dictionary[:0, :0], NO_LANGUAGE)
    record = scene.record
    record = replace(
        record,
        atom_names={k: name for k, name in record.atom_names.items() if k < num_atoms},
        atom_denials={k: words for k, words in record.atom_denials.items() if k < num_atoms},
        silent_atoms=tuple(k for k in record.silent_atoms if k < num_atoms),
        lone_atoms=tuple(k for k in record.lone_atoms if k < num_atoms),
    )
    return replace(first, semantics=semantics, record=record)


def _first(scene: Scene, count: int) -> Scene:
    """So many of the Gaussians. Levels and confidences that tell nothing, as a scene without them is given
    in a merge, go."""
    first = scene.rows(torch.arange(count))
    levels, confidences = first.levels, first.confidences
    return replace(
        first,
        levels=None if levels is None or not bool(levels.any()) else levels,
        confidences=None if confidences is None or bool((confidences == 1).all()) else confidences,
    )


def atoms_of(scene: Scene) -> tuple[Atom, ...]:
    """The atoms as a saved scene names and silences them."""
    record, silent = scene.record, set(scene.record.silent_atoms)
    names, denials = record.atom_names, record.atom_denials
    every = range(scene.semantics.num_atoms)
    return tuple(Atom(k, names.get(k, ""), k not in silent, denials.get(k, ())) for k in every)


def first_marks(scene: Scene) -> Marks:
    """The marks of a scene as it was opened."""
    return replace(
        Marks.without_edits(len(scene.gaussians), scene.semantics.num_atoms),
        atoms=atoms_of(scene),
        camera_path=tuple(scene.record.camera_path),
        metric_scale=scene.record.metric_scale,
        tour=scene.record.tour,
        world=scene.record.world,
        thing_names=scene.record.thing_names,
    )


def _masses(scene: Scene) -> Tensor:
    """(K,) opacity that carries each atom."""
    semantics = scene.semantics
    shares = (semantics.weight_values * scene.gaussians.opacities[:, None]).flatten()
    return semantics.dictionary.new_zeros(semantics.num_atoms).index_add(
        0, semantics.weight_ids.flatten(), shares.to(semantics.dictionary)
    )


def _merge_atoms(scene: Scene, atoms: Sequence[Atom]) -> Scene:
    """The scene with one row per merged atom, their names and silence in its record."""
    semantics = scene.semantics
    heads = sorted({atom.into for atom in atoms})
    places = {head: place for place, head in enumerate(heads)}
    speaking = [replace(atom, on=True) for atom in atoms]
    ids = semantics.weight_ids
    if heads:
        renumbered = torch.tensor([places[atom.into] for atom in atoms])
        ids = renumbered[ids]
    dictionary = edited_dictionary(scene, speaking)[heads] if heads else semantics.dictionary
    record = replace(
        scene.record,
        atom_names={places[k]: atoms[k].name for k in heads if atoms[k].name},
        atom_denials={places[k]: atoms[k].denied for k in heads if atoms[k].denied},
        silent_atoms=tuple(places[k] for k in heads if not atoms[k].on),
        lone_atoms=tuple(places[k] for k in heads if k in scene.record.lone_atoms),
    )
    return replace(scene, semantics=replace(semantics, weight_ids=ids, dictionary=dictionary), record=record)
