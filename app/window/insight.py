"""The worker's side of asking: prompt sets, histograms of scores, what there is to say about atoms."""

import io

import numpy as np
from PIL import Image

from app.window.ask_messages import (
    DescribeAtoms,
    Described,
    Histograms,
    PromptsLoaded,
    PromptsWritten,
    ReadPrompts,
    Request,
    Result,
    WritePrompts,
)
from app.window.asking import BINS, Histogram, Insight
from app.window.messages import Answer
from app.window.prompt_sets import read_prompts, write_prompts

CELL = 4  # pixels of a photo as the network saw it, along a side
THUMBNAIL_SIDE = 96
NEAR_ENOUGH = 1.05  # of the nearest depth in a cell: what lies behind is hidden


def run(request: Request) -> Result:
    """The answer to a request.

    Raises:
        LangFlashError: what the library raises.
    """
    match request:
        case WritePrompts(chosen, path):
            write_prompts(chosen, path)
            return PromptsWritten(path)
        case ReadPrompts(path):
            return PromptsLoaded(path, read_prompts(path))
        case DescribeAtoms():
            return describe_atoms(request)


def bin_scores(request: Answer) -> Histograms:
    """How many covered pixels of a view score how high, by phrase."""
    from langflash_core.language.answers import COVERED_ALPHA

    covered = request.frame.alphas >= COVERED_ALPHA
    rows = zip(request.keys, request.query.texts, request.relevance, strict=True)
    made = []
    for key, text, relevance in rows:
        counts, _ = np.histogram(relevance[covered].numpy(), BINS, (0.0, 1.0))
        made.append(Histogram(key, text, tuple(int(n) for n in counts)))
    return Histograms(request.serial, tuple(made))


def describe_atoms(request: DescribeAtoms) -> Described:
    """Shares, colours, cosines and a small picture of every atom."""
    import torch
    from torch.nn.functional import normalize

    from langflash_core.export.colours import atom_colours

    scene = request.scene
    dictionary = scene.semantics.dictionary.double()
    dictionary = torch.where(torch.isfinite(dictionary).all(-1, keepdim=True), dictionary, 0.0)
    unit = normalize(dictionary, dim=-1)
    masses = _carried(scene, np.ones(len(scene.gaussians), bool))
    colours = atom_colours(scene.semantics.dictionary.double().numpy())
    similarity = (unit @ unit.T).numpy()
    insight = Insight(
        shares=tuple(float(share) for share in masses / max(masses.sum(), 1e-12)),
        colours=tuple((float(r), float(g), float(b)) for r, g, b in colours),
        order=alike_order(similarity),
        similarity=similarity,
    )
    return Described(request.serial, insight, thumbnails(scene))


def alike_order(similarity: np.ndarray) -> tuple[int, ...]:
    """An order (K,) of rows in which alike ones are near: each next to its likest among the rest.

    Starts at the row least like all others.
    """
    count = len(similarity)
    left = set(range(count))
    order: list[int] = []
    while left:
        rest = sorted(left)
        scores = similarity[order[-1], rest] if order else -similarity[rest].sum(1)
        order.append(rest[int(np.argmax(scores))])
        left.remove(order[-1])
    return tuple(order)


def _carried(scene, rows: np.ndarray) -> np.ndarray:
    """(K,) opacity with which some of the Gaussians carry each atom."""
    ids = scene.semantics.weight_ids.numpy()[rows]
    shares = (scene.semantics.weight_values * scene.gaussians.opacities[:, None]).double().numpy()[rows]
    return np.bincount(
        ids.ravel(), np.nan_to_num(shares, posinf=0).ravel(), minlength=scene.semantics.num_atoms
    )


def thumbnails(scene) -> tuple[np.ndarray | None, ...]:
    """For each atom the part of a photo that carries it most, (side, side, 3) uint8; None where none does."""
    maps = [_cells(scene, view) for view in range(len(scene.photos))]
    photos = [_decoded(photo) for photo in scene.photos]
    made: list[np.ndarray | None] = []
    for k in range(scene.semantics.num_atoms):
        totals = [cells[k].sum() for cells in maps]
        view = int(np.argmax(totals)) if totals else 0
        photo = photos[view] if totals and totals[view] > 0 else None
        made.append(None if photo is None else _crop(photo, maps[view][k]))
    return tuple(made)


def _cells(scene, view: int) -> np.ndarray:
    """(K, h, w): how much of each atom the cells of a photo show, of what is not hidden there."""
    camera = scene.camera(view)
    viewmat, K = camera.viewmat.double().numpy(), camera.K.double().numpy()
    pos_c = scene.gaussians.means.double().numpy() @ viewmat[:3, :3].T + viewmat[:3, 3]
    z = pos_c[:, 2]
    width, height = -(-camera.width // CELL), -(-camera.height // CELL)
    with np.errstate(all="ignore"):
        x = (pos_c[:, 0] / z * K[0, 0] + K[0, 2]) / CELL
        y = (pos_c[:, 1] / z * K[1, 1] + K[1, 2]) / CELL
        inside = (z > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
    rows = np.flatnonzero(inside)
    cells = y[rows].astype(int) * width + x[rows].astype(int)
    nearest = np.full(width * height, np.inf)
    np.minimum.at(nearest, cells, z[rows])
    seen = z[rows] <= NEAR_ENOUGH * nearest[cells]
    rows, cells = rows[seen], cells[seen]
    semantics = scene.semantics
    ids = semantics.weight_ids.numpy()[rows]
    shares = (semantics.weight_values * scene.gaussians.opacities[:, None]).double().numpy()[rows]
    flat = (ids * (width * height) + cells[:, None]).ravel()
    maps = np.bincount(flat, np.nan_to_num(shares).ravel(), minlength=semantics.num_atoms * width * height)
    return maps.reshape(semantics.num_atoms, height, width)


def _crop(photo: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The square of a photo (H, W, 3) around the densest place of an atom's cells (h, w)."""
    height, width = cells.shape
    padded = np.pad(cells, 2)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (5, 5)).sum((-1, -2))
    row, column = np.unravel_index(windows.argmax(), windows.shape)
    dense = int((cells > 0.5 * cells.max()).sum())
    side = float(np.clip(1.3 * np.sqrt(dense), 6, min(height, width)))
    top = float(np.clip(row + 0.5 - side / 2, 0, height - side))
    left = float(np.clip(column + 0.5 - side / 2, 0, width - side))
    down, right = photo.shape[0] / height, photo.shape[1] / width
    box = (left * right, top * down, (left + side) * right, (top + side) * down)
    size = (THUMBNAIL_SIDE, THUMBNAIL_SIDE)
    return np.asarray(Image.fromarray(photo).resize(size, Image.Resampling.BILINEAR, box))


def _decoded(photo: bytes) -> np.ndarray | None:
    try:
        with Image.open(io.BytesIO(photo)) as opened:
            return np.asarray(opened.convert("RGB"))
    except OSError:  # a scene whose small photos are damaged still has its words
        return None
