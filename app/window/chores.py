"""The worker's side of editing: each request to its result, by the library. No OpenGL, no ImGui."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from app.window import autosave
from app.window.edit_messages import (
    AtomWords,
    EditsFound,
    EditsKept,
    FindAtom,
    FindByPhrase,
    FindInRegion,
    FloatersScored,
    ForgetEdits,
    ForgetFile,
    GrowSelection,
    KeepEdits,
    LookForEdits,
    NameAtoms,
    NamePlace,
    PlaceNamed,
    Request,
    Result,
    ScoreFloaters,
    SelectionFound,
    Weigh,
    Weighed,
)
from app.window.editing import Reading, strongest
from app.window.poses import Pose, to_camera
from langflash_core.scene.edits import Mask

SEEN = 0.05  # of a pixel's colour: a Gaussian that adds less anywhere in a region is not seen there
MOST_PIXELS = 120_000  # of a region; a larger one is looked at coarser, which takes seconds less
WORDS_ASKED, WORDS_OF_ATOM = 6, 3


def run(request: Request) -> Result | None:
    """The answer to a request, if it has one.

    Raises:
        LangFlashError: what the library raises.
    """
    match request:
        case FindInRegion():
            return find_in_region(request)
        case FindByPhrase():
            what = f"by {request.text!r}"
            return SelectionFound(request.serial, Mask.of(_meant(request)), request.combine, what)
        case FindAtom():
            return find_atom(request)
        case GrowSelection():
            return grow_selection(request)
        case ScoreFloaters():
            from langflash_core.scene.selection import isolation

            scores = isolation(request.scene.gaussians, request.marks.visible.rows())
            return FloatersScored(request.serial, scores.tobytes())
        case NamePlace():
            return name_place(request)
        case Weigh():
            return Weighed(request.serial, _with_atoms(request.reading, weigh(request)))
        case NameAtoms():
            return name_atoms(request)
        case KeepEdits(serial, scene, history, name, path, token):
            return EditsKept(serial, autosave.keep(scene, history, name, path, token))
        case ForgetEdits(scene, token):
            autosave.forget(scene, token)
        case ForgetFile(edits):
            autosave.forget_file(edits)
        case LookForEdits(serial, scene, path):
            offer = autosave.find(scene, path)
            return None if offer is None else EditsFound(serial, offer)
    return None


def find_in_region(request: FindInRegion) -> SelectionFound:
    """Gaussians that add at least `SEEN` to some pixel of the region, of what is shown."""
    import torch

    from langflash_core.splat.contributions import contributions

    visible = request.marks.visible.rows()
    pixels = request.region.pixels(*request.size)
    scale = min(1.0, (MOST_PIXELS / max(int(pixels.sum()), 1)) ** 0.5)
    if scale < 1.0:
        width, height = (max(1, round(side * scale)) for side in request.size)
        pixels = request.region.pixels(width, height, width / request.size[0])
    camera = to_camera(request.pose, pixels.shape[1], pixels.shape[0])
    rows = torch.from_numpy(np.flatnonzero(visible))
    shown = request.scene.gaussians.map(lambda values: values[rows].double())
    shares = contributions(shown, camera, torch.from_numpy(pixels), through=request.through)
    found = np.zeros(len(visible), bool)
    found[rows[shares >= SEEN].numpy()] = True
    return SelectionFound(request.serial, Mask.of(found), request.combine, request.region.what)


def find_atom(request: FindAtom) -> SelectionFound:
    """Gaussians whose strongest atom is the one asked for, or one merged with it."""
    from langflash_core.scene.selection import strongest_atoms

    heads = np.array([atom.into for atom in request.marks.atoms] + [-1])  # the last for "none"
    found = heads[strongest_atoms(request.scene.semantics)] == heads[request.atom]
    return SelectionFound(request.serial, Mask.of(found), request.combine, f"of atom {request.atom}")


def grow_selection(request: GrowSelection) -> SelectionFound:
    """The selection with its surroundings; a spacing is the median one of what is shown."""
    from langflash_core.scene.selection import grow, spacing

    means = request.scene.gaussians.means.numpy()
    visible = request.marks.visible.rows()
    allowed = visible & _meant(request.within) if request.within else visible
    distance = request.reach * spacing(means[visible])
    found = grow(means, request.marks.selected.rows(), allowed, distance)
    what = f"around, {request.within.text!r}" if request.within else "around"
    return SelectionFound(request.serial, Mask.of(found), "add", what)


def weigh(request: Weigh) -> np.ndarray:
    """Weights (K,) of a pixel, composed exactly; a view is projected once for all its pixels."""
    import torch

    rows, footprints = _projected(request.scene, request.marks.visible, request.pose, request.size)
    from langflash_core.splat.contributions import composition

    x, y = (min(max(int(at), 0), side - 1) for at, side in zip(request.reading.at, request.size, strict=True))
    here, shares = composition(footprints, x, y)
    semantics = request.scene.semantics
    weights = torch.zeros(semantics.num_atoms, dtype=torch.float64)
    ids, values = semantics.weight_ids[rows[here]], semantics.weight_values[rows[here]]
    weights.index_add_(0, ids.flatten(), (values * shares[:, None]).flatten())
    return weights.float().numpy()


_views: dict[tuple, tuple] = {}  # the last view that was projected


def _projected(scene, visible: Mask, pose: Pose, size: tuple[int, int]):
    """Rows of what is shown, and their footprints in a view."""
    import torch

    from langflash_core.splat import project

    key = (id(scene), visible, pose, size)
    if key not in _views:
        rows = torch.from_numpy(np.flatnonzero(visible.rows()))
        shown = scene.gaussians.map(lambda values: values[rows].double())
        _views.clear()
        _views[key] = scene, rows, project(shown, to_camera(pose, *size))
    return _views[key][1:]


def _with_atoms(reading: Reading, weights: np.ndarray) -> Reading:
    return replace(reading, atoms=strongest(weights))


def name_place(request: NamePlace) -> PlaceNamed:
    """The nearest words of F(p) = W D, of the household's and the person's own."""
    import torch

    from langflash_core.language.words import feature_at, nearest_words

    scene = _spoken(request)
    weights = np.frombuffer(request.weights, np.float32).copy() if request.weights else weigh(request)
    vector = feature_at(torch.from_numpy(weights), scene.semantics.dictionary)
    words, embeddings = _vocabulary(scene.semantics.space, request.extra)
    near = nearest_words(vector, words, embeddings, WORDS_ASKED)
    pairs = tuple((each.word, each.cosine) for each in near)
    content = vector.float().numpy().tobytes() if near else b""
    reading = _with_atoms(request.reading, weights)
    return PlaceNamed(request.serial, request.reading, reading, pairs, content)


def name_atoms(request: NameAtoms) -> AtomWords:
    """The nearest household words of every atom."""
    from langflash_core.language.words import nearest_words

    scene = _spoken(request)
    words, embeddings = _vocabulary(scene.semantics.space, ())
    rows = (nearest_words(d, words, embeddings, WORDS_OF_ATOM) for d in scene.semantics.dictionary)
    return AtomWords(request.serial, tuple(tuple(each.word for each in row) for row in rows))


def _meant(request: FindByPhrase) -> np.ndarray:
    """(N,) bool: Gaussians whose own relevance reaches the threshold."""
    import torch

    from langflash_core.language.gaussians import gaussian_relevance
    from langflash_core.language.relevance import compile_query
    from langflash_core.language.spaces import language_space
    from langflash_core.language.words import with_vectors

    scene = _spoken(request)
    space = language_space(scene.semantics.space)
    query = compile_query(scene, space, [request.text], negatives=list(request.negatives) or None)
    if request.like:
        vector = torch.from_numpy(np.frombuffer(request.like, np.float32).copy())
        query = with_vectors(query, scene.semantics.dictionary, {0: vector})
    return (gaussian_relevance(scene.semantics, query)[0] >= request.threshold).numpy()


def _spoken(request):
    from langflash_core.scene.edited import spoken_scene

    return spoken_scene(request.scene, request.marks)


def household_words() -> tuple[str, ...]:
    """The names of things in a room that the project knows."""
    from langflash_core.language.vocabulary import OWN

    return tuple(OWN)


@lru_cache(maxsize=4)
def _household(space: str):
    from langflash_core.language.spaces import language_space

    return language_space(space).encode(list(household_words()))


def _vocabulary(space: str, extra: tuple[str, ...]):
    """Words and unit embeddings (A, C): the household's, and the person's own."""
    import torch

    from langflash_core.language.algebra import encode_prompts
    from langflash_core.language.spaces import language_space

    known = household_words()
    own = tuple(dict.fromkeys(text for text in extra if text and text not in known))
    if not own:
        return known, _household(space)
    return known + own, torch.cat((_household(space), encode_prompts(language_space(space), own)))
