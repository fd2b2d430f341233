"""The scene that edits describe: what phrases are asked of, and what is saved."""

from collections.abc import Sequence
from dataclasses import replace

import torch
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.edits import Atom, Marks
from langflash_core.types import Scene, Semantics

NAMES, SILENT = "atom_names", "silent_atoms"
"""Keys of a scene's metadata: {atom: name a person gave it}; atoms that answer no phrase."""


def edited_dictionary(scene: Scene, atoms: Sequence[Atom]) -> Tensor:
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
    return replace(scene, semantics=semantics).with_metadata(**{SILENT: []})


def edited_scene(scene: Scene, marks: Marks) -> Scene:
    """The scene to save: without deleted Gaussians, merged atoms as one, names in its metadata.

    Hidden Gaussians are kept. Untouched marks give back the scene itself.
    """
    if not marks.deleted and marks.atoms == atoms_of(scene):
        return scene
    kept = torch.from_numpy(~marks.deleted.rows())
    semantics, changes = _joined(scene, marks.atoms)
    semantics = replace(
        semantics, weight_ids=semantics.weight_ids[kept], weight_values=semantics.weight_values[kept]
    )
    counts = scene.metadata.get("gaussians_per_view")
    if counts and sum(counts) == len(kept):
        changes["gaussians_per_view"] = [int(part.sum()) for part in kept.split(list(counts))]
    changes["edits"] = {"deleted": scene.metadata.get("edits", {}).get("deleted", 0) + int((~kept).sum())}
    gaussians = scene.gaussians.map(lambda values: values[kept])
    return replace(scene, gaussians=gaussians, semantics=semantics).with_metadata(**changes)


def atoms_of(scene: Scene) -> tuple[Atom, ...]:
    """The atoms as a saved scene names and silences them."""
    names, silent = scene.metadata.get(NAMES, {}), set(scene.metadata.get(SILENT, ()))
    return tuple(
        Atom(k, str(names.get(str(k), "")), k not in silent) for k in range(scene.semantics.num_atoms)
    )


def first_marks(scene: Scene) -> Marks:
    """The marks of a scene as it was opened."""
    return replace(Marks.untouched(len(scene.gaussians), scene.semantics.num_atoms), atoms=atoms_of(scene))


def _masses(scene: Scene) -> Tensor:
    """(K,) opacity that carries each atom."""
    semantics = scene.semantics
    shares = (semantics.weight_values * scene.gaussians.opacities[:, None]).flatten()
    return semantics.dictionary.new_zeros(semantics.num_atoms).index_add(
        0, semantics.weight_ids.flatten(), shares.to(semantics.dictionary)
    )


def _joined(scene: Scene, atoms: Sequence[Atom]) -> tuple[Semantics, dict]:
    """Semantics with one row per merged atom, and the metadata of names and silence."""
    semantics = scene.semantics
    heads = sorted({atom.into for atom in atoms})
    places = {head: place for place, head in enumerate(heads)}
    speaking = [replace(atom, on=True) for atom in atoms]
    ids = semantics.weight_ids
    if heads:
        renumbered = torch.tensor([places[atom.into] for atom in atoms])
        ids = renumbered[ids]
    dictionary = edited_dictionary(scene, speaking)[heads] if heads else semantics.dictionary
    changes = {
        NAMES: {str(places[k]): atoms[k].name for k in heads if atoms[k].name},
        SILENT: [places[k] for k in heads if not atoms[k].on],
    }
    return replace(semantics, weight_ids=ids, dictionary=dictionary), changes
