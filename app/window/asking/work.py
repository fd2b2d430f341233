"""The worker's side of asking: phrases compiled and scored, prompt sets, what there is to say about
atoms. Heavy imports wait until they are needed."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import repeat
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from langflash_core.geometry.poses import Vector
from langflash_core.scene.edits import Marks
from langflash_core.scene.mask import Mask

from ..commands import Command, Notify, ShowPicture
from ..drawing.values import View
from ..requests import Asked, SceneTask, Task
from ..scene.memory import SceneMemory
from .commands import (
    Answered,
    AtomsDescribed,
    AtomsWeighed,
    Binned,
    Narrowed,
    PhrasesCompiled,
    PhrasesPlaced,
    PromptsRead,
)
from .parting import PartsListed
from .prompt_sets import PromptSet, read_prompts, write_prompts
from .state import BINS, Histogram, Insight, Part, Parts

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.types import Scene


@dataclass(frozen=True)
class Encode(SceneTask):
    """Compile phrases against a scene; milliseconds once the text tower is loaded.

    likes: per phrase a language vector as float32 bytes, asked instead of the text, or none.
    revision: as `Asking.revision` is.
    """

    newest_counts = True

    scene: "Scene" = field(repr=False)
    keys: tuple[int, ...]
    texts: tuple[str, ...]
    negatives: tuple[str, ...]
    likes: tuple[bytes, ...] = ()
    marks: Marks | None = None
    revision: int = 0

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.language.gaussians import answering_shares, photos_that_answer
        from langflash_core.language.grammar import whole
        from langflash_core.language.relevance import spoken_dictionary
        from langflash_core.language.spaces import language_space
        from langflash_core.language.spoken import compile_spoken
        from langflash_core.language.words import with_vectors
        from langflash_core.scene.edited import spoken_scene

        scene = self.scene if self.marks is None else spoken_scene(self.scene, self.marks)
        space = language_space(scene.semantics.space)
        query = compile_spoken(scene, space, list(self.texts), negatives=list(self.negatives) or None)
        likes = {row: _vector(like) for row, like in enumerate(self.likes) if like}
        query = with_vectors(query, spoken_dictionary(scene, space), likes)
        if likes:
            readings = (
                whole(text) if row in likes else read
                for row, (text, read) in enumerate(zip(query.texts, query.readings, strict=True))
            )
            query = replace(query, readings=tuple(readings))
        noted = zip(query.notes, self.likes or repeat(b""), strict=False)
        notes = tuple("" if like else note for note, like in noted)
        readings = tuple("" if reading.whole else str(reading) for reading in query.readings)
        yield PhrasesCompiled(self.keys, query, self.revision, notes, readings)
        if not stopping():
            shares = answering_shares(scene, query, _there(self.marks, len(scene.gaussians)))
            yield PhrasesPlaced(self.keys, query.texts, photos_that_answer(shares), self.revision)


def _there(marks: Marks | None, count: int) -> "Tensor | None":
    """(count,) which of a scene's Gaussians are left, as it came."""
    import torch

    return None if marks is None else torch.from_numpy(marks.left.rows()[:count])


def _vector(content: bytes) -> "Tensor":
    import torch

    return torch.from_numpy(np.frombuffer(content, np.float32).copy())


@dataclass(frozen=True)
class Answer(SceneTask):
    """Score phrases in one view, of what they mean alone, and count how its pixels score."""

    newest_counts = True

    view: View

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.language.answers import answer, best_places
        from langflash_core.language.narrowing import narrow_view

        view, revision = self.view, self.view.revision
        relevance, query = view.relevance, view.query
        if query.narrows:
            limits = view.cuts or (query.threshold,) * len(view.keys)
            seen = (relevance, view.others, view.frame, view.camera, np.array(view.up))
            relevance, query = narrow_view(query, *seen, limits)
            choosing = zip(view.keys, query.texts, query.notes, query.readings, strict=True)
            notes = tuple((key, text, note) for key, text, note, reading in choosing if reading.narrows)
            yield Narrowed(view.name, relevance, notes, revision)
        result = answer(relevance, view.frame, view.camera, query)
        answers = zip(view.keys, result.answers, strict=True)
        scores = tuple((key, a.prompt, float(a.score)) for key, a in answers)
        places = best_places(relevance, view.frame, view.camera)
        yield Answered(scores, revision, tuple(p and Vector(*p) for p in places))
        yield Binned(tuple(self._histograms(relevance)), revision)

    def _histograms(self, relevance: "Tensor") -> Iterator[Histogram]:
        """How many covered pixels of the view score how high, by phrase."""
        from langflash_core.language.settings import ANSWERING

        covered = self.view.frame.alphas >= ANSWERING.covered_alpha
        for key, text, own in zip(self.view.keys, self.view.query.texts, relevance, strict=True):
            counts, _ = np.histogram(own[covered].numpy(), BINS, (0.0, 1.0))
            yield Histogram(key, text, tuple(int(n) for n in counts))


@dataclass(frozen=True)
class ListParts(SceneTask):
    """Take the answer to a phrase apart: what is connected and looks like one kind of thing is a part. What
    is too small to be one belongs to the nearest."""

    newest_counts = True

    memory: SceneMemory = field(repr=False)
    marks: Marks
    text: str
    negatives: tuple[str, ...]
    cut: float

    def run(self, stopping: Asked) -> Iterator[Command]:
        import torch

        from langflash_core.inventory.pieces import kinds_of
        from langflash_core.language.spaces import language_space
        from langflash_core.language.spoken import compile_spoken
        from langflash_core.meant import meant_relevance
        from langflash_core.scene.edited import spoken_scene, without_deleted
        from langflash_core.segments import photo_shares

        marks, memory = self.marks, self.memory
        scene = without_deleted(spoken_scene(memory.changed(marks), marks), marks)
        space = language_space(scene.semantics.space)
        compiled = compile_spoken(scene, space, [self.text], negatives=list(self.negatives) or None)
        relevance = meant_relevance(scene, compiled, [self.cut])[0][0].cpu()
        members = (relevance >= self.cut).numpy()
        where = (marks.left, marks.changes)
        shares = memory.answered("photo shares", where, lambda: photo_shares(scene))
        kinds = memory.answered("kinds", (*where, marks.atoms), lambda: kinds_of(scene))
        numbers = _divided(scene, members, kinds, shares)
        there, found = np.flatnonzero(marks.left.rows()), []
        for number in range(1, int(numbers.max(initial=0)) + 1):
            rows = np.zeros(marks.deleted.count, bool)
            rows[there[numbers == number]] = True
            own = torch.from_numpy(numbers == number)
            found.append(_part(scene, own, kinds, relevance, shares[:, own].sum(1), Mask.of(rows)))
        found.sort(key=lambda part: -part.share)
        yield PartsListed(Parts(self.text, self.cut, tuple(found)))


def _divided(scene: "Scene", members: np.ndarray, kinds: np.ndarray, shares: "Tensor") -> np.ndarray:
    """(N,) numbers of parts, 0 of no member. shares: (V, N)."""
    import torch
    from scipy.spatial import KDTree

    from langflash_core.segments import connected_things

    numbers = np.zeros(len(members), np.int64)
    for kind in np.unique(kinds[members]):
        own = connected_things(scene, torch.from_numpy(members & (kinds == kind)), shares).numpy()
        numbers[own > 0] = own[own > 0] + numbers.max(initial=0)
    if not numbers.any():
        return connected_things(scene, torch.from_numpy(members), shares).numpy()
    rest = members & (numbers == 0)
    if rest.any():
        means, parted = np.nan_to_num(scene.gaussians.means.double().numpy()), np.flatnonzero(numbers)
        numbers[rest] = numbers[parted[KDTree(means[parted]).query(means[rest])[1]]]
    return numbers


def _part(
    scene: "Scene", own: "Tensor", kinds: np.ndarray, relevance: "Tensor", shares: "Tensor", rows: Mask
) -> Part:
    """What there is to say of one part; own: (N,) bool, shares: (V,) of photos."""
    from langflash_core.geometry.surfels import covered_areas
    from langflash_core.inventory.pieces import KINDS

    some = scene.rows(own)
    areas = covered_areas(some.gaussians) + 1e-12
    means = some.gaussians.means.double().numpy()
    middle = np.median(means, axis=0)
    place = means[
        np.linalg.norm(means - middle, axis=1).argmin()
    ]  # on the thing, not between two of its ends
    places, counts = np.unique(kinds[own.numpy()], return_counts=True)
    sure = float(np.average(relevance[own].numpy(), weights=areas))
    return Part(KINDS[places[counts.argmax()]], sure, float(shares.max()), Vector(*place.tolist()), rows)


@dataclass(frozen=True)
class WritePrompts(Task):
    """Write a prompt set."""

    saves = True

    chosen: PromptSet
    path: Path

    def run(self, stopping: Asked) -> Iterator[Command]:
        write_prompts(self.chosen, self.path)
        yield Notify(f"Saved {self.path}", "info")


@dataclass(frozen=True)
class ReadPrompts(Task):
    """Read a prompt set."""

    path: Path

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield PromptsRead(self.path, read_prompts(self.path))


@dataclass(frozen=True)
class DescribeAtoms(SceneTask):
    """Look the atoms over: shares, colours, cosines, and a small picture of each that a photo shows."""

    scene: "Scene" = field(repr=False)
    marks: Marks | None = None

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.export.colours import atom_colours
        from langflash_core.scene.atoms import atom_pictures, describe_atoms

        report = describe_atoms(self.scene)
        shares = _shares(self.scene, self.marks)
        colours = atom_colours(self.scene.semantics.dictionary.double().numpy())
        for k, rgb in enumerate(atom_pictures(self.scene)):
            if rgb is not None:
                yield ShowPicture(f"atom {k}", rgb)
        yield AtomsDescribed(
            Insight(
                shares=shares,
                colours=tuple((float(r), float(g), float(b)) for r, g, b in colours),
                order=report.order,
                similarity=report.similarity,
                places=_places(self.scene, self.marks),
            )
        )


@dataclass(frozen=True)
class WeighAtoms(SceneTask):
    """How much of what is left of the scene each atom carries."""

    newest_counts = True

    scene: "Scene" = field(repr=False)
    marks: Marks

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield AtomsWeighed(_shares(self.scene, self.marks), _places(self.scene, self.marks))


def _shares(scene: "Scene", marks: Marks | None) -> tuple[float, ...]:
    """(K,) of the opacity that is left, sum 1."""
    from langflash_core.scene.atoms import atom_shares
    from langflash_core.scene.edited import without_deleted

    return tuple(map(float, atom_shares(scene if marks is None else without_deleted(scene, marks))))


def _places(scene: "Scene", marks: Marks | None) -> tuple[Vector | None, ...]:
    """(K,) where each atom is by now, world; None where nothing of it is left."""
    from langflash_core.scene.atoms import atom_places
    from langflash_core.scene.changed import changed_scene
    from langflash_core.scene.edited import without_deleted

    placed = scene if marks is None else without_deleted(changed_scene(scene, marks), marks)
    return tuple(place and Vector(*place) for place in atom_places(placed))
