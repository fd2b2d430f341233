"""The worker's side of editing: what must be computed to select, and the words of places and atoms.

Heavy imports wait until they are needed. No OpenGL, no ImGui.
"""

from collections.abc import Generator, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from langflash_core.errors import LangFlashError
from langflash_core.geometry.poses import Pose, to_camera
from langflash_core.mending.recipes import Box, Recipe
from langflash_core.scene.edits import Combine, Marks
from langflash_core.scene.mask import Mask

from ..commands import Command, Notify
from ..requests import Asked, SceneTask
from ..scene.memory import SceneMemory
from ..scene.state import SceneInfo
from ..state import State
from .cleaning import as_sentence
from .commands import (
    FloatersFound,
    Found,
    Grow,
    SelectAtom,
    SelectByPhrase,
    SelectRegion,
    SelectSphere,
    SelectThing,
    StopWaiting,
)
from .mending import MarginsFound
from .pointing import AtomsNamed, Named, ReadingTaken
from .state import BY_STRENGTH, PICK_RADIUS, Outline, Point, Reading, Region, strongest
from .teaching import WordsFound, with_kept
from .things import Outlined, Searched, ThingFound

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.scene.regions import Regions
    from langflash_core.types import Scene

MOST_PIXELS = 120_000  # of a region; a larger one is looked at coarser, which takes seconds less
WORDS_ASKED, WORDS_OF_ATOM = 6, 3


@dataclass(frozen=True)
class EditTask(SceneTask):
    """About a scene as its marks show it."""

    memory: SceneMemory = field(repr=False)
    marks: Marks = field(repr=False)

    @property
    def scene(self) -> "Scene":
        return self.memory.scene

    def placed(self) -> "Scene":
        """With its Gaussians where edits moved them."""
        return self.memory.changed(self.marks)

    def spoken(self) -> "Scene":
        """The scene with its atoms merged and silenced as marked."""
        from langflash_core.scene.edited import spoken_scene

        return spoken_scene(self.scene, self.marks)

    def dictionary(self) -> "Tensor":
        """Of that scene, as its person taught it."""
        from langflash_core.language.relevance import spoken_dictionary
        from langflash_core.language.spaces import language_space

        return spoken_dictionary(self.spoken(), language_space(self.scene.semantics.space))


# Selections


@dataclass(frozen=True)
class Selection(EditTask):
    """Something looks for Gaussians and waits for it."""

    def failed(self, sentence: str) -> Iterable[Command]:
        return Notify(sentence), StopWaiting()


@dataclass(frozen=True)
class FindInRegion(Selection):
    """Gaussians that a region shows. size: of the picture's place, pixels."""

    region: Region
    pose: Pose
    size: tuple[int, int]
    through: bool
    combine: Combine

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.splat.picking import seen_in

        pixels = self.region.pixels(*self.size)
        scale = min(1.0, (MOST_PIXELS / max(int(pixels.sum()), 1)) ** 0.5)
        if scale < 1.0:
            width, height = (max(1, round(side * scale)) for side in self.size)
            pixels = self.region.pixels(width, height, width / self.size[0])
        camera = to_camera(self.pose, pixels.shape[1], pixels.shape[0])
        visible = self.marks.visible.rows()
        found = seen_in(self.placed(), visible, camera, pixels, through=self.through)
        yield Found(Mask.of(found), self.combine, self.region.what)


@dataclass(frozen=True)
class AtPixel(Selection):
    """Something about what a pixel shows. at: framebuffer pixels of the picture's place, which has `size`."""

    at: Point
    pose: Pose
    size: tuple[int, int]
    combine: Combine

    def seen(self) -> np.ndarray:
        """(N,) bool: the Gaussians that a small disc around the pixel shows."""
        from langflash_core.splat.picking import seen_in

        pixels = Region((self.at,), PICK_RADIUS).pixels(*self.size)
        camera = to_camera(self.pose, *self.size)
        return seen_in(self.placed(), self.marks.visible.rows(), camera, pixels)


@dataclass(frozen=True)
class FindThing(AtPixel):
    """The thing that the pixel shows, its parts, and what it is part of; where none is known, what the pixel
    shows."""

    def run(self, stopping: Asked) -> Iterator[Command]:
        seen, visible = self.seen(), self.marks.visible
        reach = (yield from regions_in(self.memory)).around(seen)
        if reach is None:
            yield Found(Mask.of(seen), self.combine, "of a thing")
            return
        levels = tuple(Mask.of(reach.rows(level)) & visible for level in range(reach.count))
        yield ThingFound(levels, reach.chosen, self.combine)


@dataclass(frozen=True)
class PrepareThings(EditTask):
    """What clicks can mean, before the first one: it takes seconds."""

    newest_counts = True

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield from regions_in(self.memory)


def regions_in(memory: SceneMemory) -> Generator[Command, None, "Regions"]:
    """The tree of a scene, as it came; slow when asked for the first time, with news of how far it is."""
    from langflash_core.scene.regions import regions_in_steps

    if memory.answer_to("regions") is None:
        for step in regions_in_steps(memory.scene):
            if isinstance(step, float):
                yield Searched(step)
            else:
                memory.answered("regions", (), lambda tree=step: tree)
        yield Searched(1.0)
    return memory.answer_to("regions")


@dataclass(frozen=True)
class DrawOutline(EditTask):
    """The line around what the picture's place, which has `size`, shows of the selection."""

    newest_counts = True

    pose: Pose
    size: tuple[int, int]

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.splat.outlines import outlines

        part, visible = self.marks.selected, self.marks.visible.rows()
        found = outlines(self.placed(), visible, part.rows(), to_camera(self.pose, *self.size))
        lines = tuple(tuple((float(x), float(y)) for x, y in line) for line in found)
        yield Outlined(Outline(lines, part, self.pose, self.size))


@dataclass(frozen=True)
class FindInSphere(AtPixel):
    """What lies within `radius` pixels, at its depth, of what the pixel shows."""

    radius: float

    def run(self, stopping: Asked) -> Iterator[Command]:
        found, means = self.seen(), self.placed().gaussians.means.double().numpy()
        if found.any():
            centre = np.median(means[found], axis=0)
            camera = to_camera(self.pose, *self.size)
            viewmat = camera.viewmat.double().numpy()
            depth = float(viewmat[2, :3] @ centre + viewmat[2, 3])
            unit = (1.0 if camera.orthographic else depth) / float(camera.K[0, 0])  # of a pixel there
            ball = np.linalg.norm(means - centre, axis=1) <= self.radius * unit
            found = ball & self.marks.visible.rows()
        yield Found(Mask.of(found), self.combine, "in a ball")


@dataclass(frozen=True)
class FindByPhrase(Selection):
    """Gaussians that a phrase, or a language vector `like`, means from `threshold` on; None: from the
    calibrated one, which the window does not know before the first answer."""

    text: str
    like: bytes
    negatives: tuple[str, ...]
    threshold: float | None
    combine: Combine

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield Found(Mask.of(self.meant()), self.combine, f"by {self.text!r}")

    def meant(self) -> np.ndarray:
        """(N,) bool: Gaussians whose own relevance reaches the threshold."""
        import torch

        from langflash_core.language.relevance import compile_query, spoken_dictionary
        from langflash_core.language.spaces import language_space
        from langflash_core.language.spoken import compile_spoken
        from langflash_core.language.words import with_vectors
        from langflash_core.meant import meant_relevance

        scene = self.spoken()
        space, negatives = language_space(scene.semantics.space), list(self.negatives) or None
        if self.like:
            query = compile_query(scene, space, [self.text], negatives=negatives)
            vector = torch.from_numpy(np.frombuffer(self.like, np.float32).copy())
            query = with_vectors(query, spoken_dictionary(scene, space), {0: vector})
        else:
            query = compile_spoken(scene, space, [self.text], negatives=negatives)
        least = query.threshold if self.threshold is None else self.threshold
        return (meant_relevance(scene, query, [least])[0][0] >= least).numpy()


@dataclass(frozen=True)
class FindAtom(Selection):
    """Gaussians whose strongest atom is the one asked for, or one merged with it."""

    atom: int
    combine: Combine

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.scene.selection import strongest_atoms

        heads = np.array([atom.into for atom in self.marks.atoms] + [-1])  # the last for "none"
        found = heads[strongest_atoms(self.scene.semantics)] == heads[self.atom]
        yield Found(Mask.of(found), self.combine, f"of group {self.atom}")


@dataclass(frozen=True)
class GrowSelection(Selection):
    """What lies within `reach` spacings of the selection, a spacing being the median one of what is
    shown, and as much more of wide Gaussians as they are wider; `within`: of what a phrase means."""

    reach: float
    within: FindByPhrase | None

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.scene.instances import disc_radii
        from langflash_core.scene.selection import grow, spacing

        placed = self.placed().gaussians
        means, radii = placed.means.numpy(), disc_radii(placed)
        visible = self.marks.visible.rows()
        allowed = visible & self.within.meant() if self.within else visible
        distance = self.reach * spacing(means[visible & self._of_one_layer(visible)])
        found = grow(means, self.marks.selected.rows(), allowed, distance, radii)
        yield Found(Mask.of(found), "add", f"around, {self.within.text!r}" if self.within else "around")

    def _of_one_layer(self, visible: np.ndarray) -> np.ndarray:
        """(N,) bool: of a scene of layers those of the largest one, in which neighbours are as far apart as a
        surface has them; else all."""
        ids = self.scene.view_ids
        if not self.scene.layered or ids is None:
            return np.ones_like(visible)
        numbers = ids.numpy()
        counts = np.bincount(numbers[visible & (numbers >= 0)], minlength=1)
        return numbers == counts.argmax() if counts.any() else np.ones_like(visible)


@dataclass(frozen=True)
class ScoreFloaters(EditTask):
    """The strength of cleaning from which every Gaussian goes, and what else a recipe finds. Where it cannot
    be followed, nothing goes."""

    newest_counts = True

    recipe: Recipe = BY_STRENGTH

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.mending.strength import least_strengths

        recipe, marks = self.recipe, self.marks
        shown, visible = self.memory.changed(marks), marks.visible
        least = self.memory.answered(
            "strengths",
            (marks.changes, visible, recipe.kinds),
            lambda: least_strengths(shown, visible.rows(), recipe.kinds).tobytes(),
        )
        try:
            yield FloatersFound(least, recipe, *self._by_rules(shown))
        except LangFlashError as problem:
            none = Mask.none(visible.count)
            yield FloatersFound(least, recipe, answering=none)
            yield Notify(as_sentence(problem))

    def _by_rules(self, shown: "Scene") -> "tuple[Mask | None, Mask | None, Mask | None, Box | None]":
        """What meets a rule, what answers its phrases, what is outside its box, and that."""
        from langflash_core.meant import answering
        from langflash_core.mending.cleaning import box_of, inside, measure_gaussians, meeting

        recipe, about = self.recipe, (self.marks.changes,)
        ruled = spoken = outside = box = None

        def measured(name: str) -> np.ndarray:
            return self.memory.answered(f"measure {name}", about, lambda: measure_gaussians(shown, name))

        for rule in recipe.rules:
            rows = Mask.of(meeting(shown, rule, measured))
            ruled = rows if ruled is None else ruled | rows
        if recipe.within:
            spoken = Mask.of(answering(self.spoken(), recipe.within))
        if recipe.crop is not None:
            box = box_of(shown, recipe.crop, self.marks.visible.rows())
            outside = Mask.of(~inside(shown, box))
        return ruled, spoken, outside, box


@dataclass(frozen=True)
class FindMargins(EditTask):
    """The margin from which on every Gaussian is hidden with the selection."""

    newest_counts = True

    def run(self, stopping: Asked) -> Iterator[Command]:
        marks = self.marks
        about = (marks.changes, marks.there, marks.left, marks.selected)
        yield MarginsFound(marks, self.memory.answered("margins", about, self._least))

    def _least(self) -> bytes:
        """(N,) float32, infinite where nothing is left."""
        import torch

        from langflash_core.mending.hiding import least_margins
        from langflash_core.mending.looks import draw_scene
        from langflash_core.scene.edited import edited_scene

        left = self.marks.left.rows()
        members = torch.from_numpy(self.marks.selected.rows()[left])
        found = np.full(len(left), np.inf, np.float32)
        found[left] = least_margins(edited_scene(self.scene, self.marks), members, draw_scene).numpy()
        return found.tobytes()


def request_for(
    command: Command, state: State, info: SceneInfo, marks: Marks, size: tuple[int, int]
) -> Selection | None:
    """What the worker must find for a command. size: of the picture's place, pixels."""
    scene = (info.serial, info.memory, marks)
    match command:
        case SelectRegion(region, combine) if min(size) > 0:
            return FindInRegion(*scene, region, state.scene.pose, size, state.editing.through, combine)
        case SelectThing(at, combine) if min(size) > 0:
            return FindThing(*scene, at, state.scene.pose, size, combine)
        case SelectSphere(at, radius, combine) if min(size) > 0:
            return FindInSphere(*scene, at, state.scene.pose, size, combine, radius)
        case SelectByPhrase(key, combine):
            return _phrase(state, info, marks, key, combine)
        case SelectAtom(atom, combine) if 0 <= atom < len(marks.atoms):
            return FindAtom(*scene, atom, combine)
        case Grow(phrase) if marks.selected:
            active = state.asking.active_prompt
            within = _phrase(state, info, marks, active.key, "add") if phrase and active else None
            return GrowSelection(*scene, state.editing.reach, within)
    return None


def _phrase(state: State, info: SceneInfo, marks: Marks, key: int, combine: Combine) -> FindByPhrase | None:
    prompt = next((p for p in state.asking.prompts if p.key == key and p.text.strip()), None)
    if prompt is None or not info.num_atoms:
        return None
    asked = (prompt.text.strip(), prompt.like, state.asking.negatives, prompt.threshold)
    return FindByPhrase(info.serial, info.memory, marks, *asked, combine)


# Places and words


@dataclass(frozen=True)
class Weigh(EditTask):
    """The groups of a pixel whose weight maps are not drawn. size: of the picture's place."""

    newest_counts = True

    reading: Reading
    pose: Pose
    size: tuple[int, int]

    def run(self, stopping: Asked) -> Iterator[Command]:
        yield ReadingTaken(self.weighed(self.weigh()))

    def weigh(self) -> np.ndarray:
        """Weights (K,) of the pixel, composed exactly; a view is projected once for all its pixels."""
        from langflash_core.splat.picking import sights, weights_at

        x, y = (min(max(int(at), 0), side - 1) for at, side in zip(self.reading.at, self.size, strict=True))
        visible, camera = self.marks.visible, to_camera(self.pose, *self.size)
        seen = self.memory.answered(
            "sights",
            (self.marks.changes, visible, self.pose, self.size),
            lambda: sights(self.placed(), visible.rows(), camera),
        )
        return weights_at(self.scene.semantics, seen, x, y).numpy()

    def weighed(self, weights: np.ndarray) -> Reading:
        """The reading with its groups."""
        return replace(self.reading, atoms=strongest(weights))


@dataclass(frozen=True)
class NamePlace(Weigh):
    """The nearest words of F(p) = W D, of the household's and of `extra`, the person's own; with the scores
    that they would have as phrases.

    weights: (K,) of the pixel as float32 bytes; none: not drawn, to be composed.
    """

    weights: bytes
    extra: tuple[str, ...]
    negatives: tuple[str, ...] = ()

    def run(self, stopping: Asked) -> Iterator[Command]:
        import torch

        from langflash_core.language.words import feature_at, nearest_words

        weights = np.frombuffer(self.weights, np.float32).copy() if self.weights else self.weigh()
        pixel = torch.from_numpy(weights)
        vector = feature_at(pixel, self.dictionary())
        own = (*self.extra, *(atom.name for atom in self.marks.atoms))
        words, embeddings = _vocabulary(self.scene.semantics.space, own)
        near = [each.word for each in nearest_words(vector, words, embeddings, WORDS_ASKED)]
        content = vector.float().numpy().tobytes() if near else b""
        yield Named(self.reading, self.weighed(weights), self._scored(pixel, near), content)

    def _scored(self, pixel: "Tensor", words: list[str]) -> tuple[tuple[str, float], ...]:
        """Words with their relevancy at the pixel, whose weights are (K,), best first."""
        from langflash_core.language.relevance import compile_query, relevance_maps
        from langflash_core.language.spaces import language_space

        if not words:
            return ()
        scene = self.spoken()
        space = language_space(scene.semantics.space)
        query = compile_query(scene, space, words, negatives=list(self.negatives) or None)
        scores = relevance_maps(pixel[None], query)[:, 0].tolist()
        return tuple(zip(words, scores, strict=True))


@dataclass(frozen=True)
class NameAtoms(EditTask):
    """The nearest household words of every atom, and which of them the scene answers."""

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.language.gaussians import answering_shares
        from langflash_core.language.relevance import compile_query
        from langflash_core.language.settings import ANSWERING
        from langflash_core.language.spaces import language_space
        from langflash_core.language.words import nearest_words

        space, spoken = self.scene.semantics.space, self.spoken()
        words, embeddings = _vocabulary(space, ())
        near = [nearest_words(d, words, embeddings, WORDS_OF_ATOM) for d in self.dictionary()]
        named = tuple(tuple(each.word for each in row) for row in near)
        asked = list(dict.fromkeys(row[0] for row in named if row))
        best = []
        if asked:
            shares = answering_shares(spoken, compile_query(spoken, language_space(space), asked))
            best = shares.amax(1).tolist()
        answered = zip(asked, best, strict=True)
        yield AtomsNamed(named, tuple(word for word, share in answered if share >= ANSWERING.top_fraction))


@dataclass(frozen=True)
class KeepLessons(EditTask):
    """Add what was taught in the scene to the person's own vocabulary."""

    path: Path

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.appearance import appearances
        from langflash_core.language.lessons import lessons_of
        from langflash_core.scene.edited import spoken_scene

        record = spoken_scene(self.scene, self.marks).record
        if not record.atom_names and not record.atom_denials:
            yield Notify("Name a group first; then the name can be used in other scenes too.", "info")
            return
        looks = appearances(self.scene)
        lessons = lessons_of(record, looks.rows, looks.network)
        known = with_kept(lessons, self.path)
        yield Notify(f"Kept {len(lessons)} for other scenes; you taught {len(known)} in all.", "info")


@dataclass(frozen=True)
class FindLessons(EditTask):
    """Which groups look like what was taught in other scenes."""

    path: Path

    def run(self, stopping: Asked) -> Iterator[Command]:
        from langflash_core.appearance import lessons_taken
        from langflash_core.language.lessons import read_lessons
        from langflash_core.scene.edited import spoken_scene

        try:
            if not self.path.exists():
                yield Notify("Nothing is saved yet; name a group and keep the name for other scenes.", "info")
                return
            record = spoken_scene(self.scene, self.marks).record
            found = lessons_taken(replace(self.scene, record=record), read_lessons(self.path))
            yield WordsFound(tuple((k, one.name, one.denied) for k, one in sorted(found.items())))
        finally:
            yield StopWaiting()


@lru_cache(maxsize=4)
def _household(space: str):
    from langflash_core.language.spaces import language_space
    from langflash_core.language.vocabulary import OWN

    return language_space(space).encode(list(OWN))


def _readable(space: str, text: str) -> bool:
    """Whether a name that a person gave can be compared with."""
    from langflash_core.errors import PromptError
    from langflash_core.language.algebra import encode_prompts
    from langflash_core.language.spaces import language_space

    try:
        return len(encode_prompts(language_space(space), [text])) == 1
    except PromptError:
        return False


def _vocabulary(space: str, extra: tuple[str, ...]):
    """Words and unit embeddings (A, C): the household's, and the person's own."""
    import torch

    from langflash_core.language.algebra import encode_prompts
    from langflash_core.language.spaces import language_space
    from langflash_core.language.vocabulary import OWN

    known = tuple(OWN)
    asked = dict.fromkeys(text for text in extra if text and text not in known)
    own = tuple(text for text in asked if _readable(space, text))
    if not own:
        return known, _household(space)
    return known + own, torch.cat((_household(space), encode_prompts(language_space(space), own)))
