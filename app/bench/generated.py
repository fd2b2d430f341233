"""Scenes and dictionaries out of nothing: a room as a two-view network predicts it, of any size."""

import math
from dataclasses import replace

import torch
from torch import Tensor
from torch.nn.functional import normalize

from langflash_core.geometry.cameras import intrinsics_from_fov, invert_rigid
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.language.relevance import CompiledQuery, reduce_dictionary
from langflash_core.scene.weights import renormalise
from langflash_core.types import Gaussians, Scene, Semantics

SPACE = "generated"
KEPT = 16  # weights per Gaussian, so that the 8 of the program leave something out
CHANNELS = 512  # of the paper
_FOV = 60.0
_BASELINE = (0.4, 0.0, 0.0)  # of the second view, room units
_TURN = math.radians(-12.0)  # of the second view, about the upright: both look at the same things
_HALF_ROOM = torch.tensor([1.3, 0.9, 2.6])  # walls at x, floor and ceiling at y, back wall at z
_BALLS = torch.tensor(
    [[-0.6, 0.5, 1.6, 0.4], [0.5, 0.6, 1.3, 0.3], [0.1, -0.2, 2.0, 0.35], [0.9, 0.2, 2.2, 0.4]]
)  # x y z radius
_SOFTNESS = 0.5  # of the groups' borders: a Gaussian's largest weight is 0.8 on average, as a network's
_ROWS_AT_ONCE = 1 << 15


def room(num_gaussians: int, size: tuple[int, int], spread: float = 1.0, seed: int = 0) -> Scene:
    """A box of a room with balls in it, a Gaussian for each jittered pixel of two views; no atoms.

    Args:
        size: (width, height) of the views. spread: of the Gaussians over their spacing, 1 as a
            network's; overdraw grows with its square.
    """
    g = torch.Generator().manual_seed(seed)
    K = intrinsics_from_fov(_FOV, *size)
    viewmats = invert_rigid(torch.stack((torch.eye(4), _second_pose())))
    counts = (num_gaussians - num_gaussians // 2, num_gaussians // 2)
    parts = [_visible(v, K, size, n, g) for v, n in zip(viewmats, counts, strict=True)]
    means, depths = (torch.cat(fields) for fields in zip(*parts, strict=True))
    spacing = math.sqrt(size[0] * size[1] / max(counts[0], 1)) / float(K[0, 0])  # per unit of depth
    shape = torch.tensor([0.6, 0.6, 0.3]) * torch.exp(0.3 * torch.randn(num_gaussians, 3, generator=g))
    wave = torch.sin(4 * means @ torch.randn(3, 3, generator=g) + torch.arange(3.0))
    colours = (0.5 + 0.3 * wave + 0.05 * torch.randn(num_gaussians, 3, generator=g)).clamp(0, 1)
    gaussians = Gaussians(
        means,
        normalize(torch.randn(num_gaussians, 4, generator=g), dim=-1),
        spread * spacing * depths[:, None] * shape,
        0.2 + 0.79 * torch.rand(num_gaussians, generator=g),
        ((colours - 0.5) / SH_C0)[:, None],
    )
    none = torch.zeros(num_gaussians, 0)
    semantics = Semantics(none.long(), none, torch.zeros(0, CHANNELS), SPACE)
    return Scene(gaussians, semantics, viewmats, torch.stack((K, K)), size)


def _second_pose() -> Tensor:
    """Camera to world (4, 4) of the second view."""
    cosine, sine = math.cos(_TURN), math.sin(_TURN)
    x, y, z = _BASELINE
    return torch.tensor([[cosine, 0, sine, x], [0, 1, 0, y], [-sine, 0, cosine, z], [0, 0, 0, 1.0]])


def _visible(
    viewmat: Tensor, K: Tensor, size: tuple[int, int], count: int, g: torch.Generator
) -> tuple[Tensor, Tensor]:
    """World points (count, 3) and their depths (count,) where rays of one view meet the room."""
    width, height = size
    columns = max(1, round(math.sqrt(count * width / height)))
    rows = max(1, -(-count // columns))
    index = torch.arange(count)
    cell = torch.stack((index % columns, index // columns), -1) + torch.rand(count, 2, generator=g)
    pixels = cell * torch.tensor([width / columns, height / rows])
    directions = torch.cat(((pixels - K[:2, 2]) / K[0, 0], torch.ones(count, 1)), -1)  # z = 1
    pose = invert_rigid(viewmat)
    directions, origin = directions @ pose[:3, :3].T, pose[:3, 3]
    walls = (_HALF_ROOM - origin * directions.sign()) / directions.abs().clamp_min(1e-6)
    depths = walls.amin(-1)
    for *centre, radius in _BALLS.tolist():
        towards = torch.tensor(centre) - origin
        a, b = directions.square().sum(-1), directions @ towards
        square = b * b - a * (towards @ towards - radius * radius)
        hit = (b - square.clamp_min(0).sqrt()) / a
        depths = torch.where((square > 0) & (hit > 0), depths.minimum(hit), depths)
    return origin + directions * depths[:, None], depths


def with_atoms(scene: Scene, num_atoms: int, seed: int = 0) -> Scene:
    """The scene with K generated atoms: weights that vary smoothly with the place, as groups do.

    Groups lie around Gaussians drawn by lot; weights are a softmax of the squared distances to them,
    of which the 16 largest are kept. Atoms share half their direction, as language vectors do.
    """
    g = torch.Generator().manual_seed(seed)
    means = torch.nan_to_num(scene.gaussians.means.float(), 0.0, 0.0, 0.0)
    centres = means[torch.randperm(len(means), generator=g)[torch.arange(num_atoms) % len(means)]]
    some = means[torch.randperm(len(means), generator=g)[:_ROWS_AT_ONCE]]
    width = torch.cdist(some, centres).square().amin(-1).median().clamp_min(1e-12)
    chunks = []
    for rows in means.split(_ROWS_AT_ONCE):
        shares = torch.softmax(-torch.cdist(rows, centres).square() / (_SOFTNESS * width), -1)
        chunks.append(shares.topk(min(KEPT, num_atoms), -1))
    values = renormalise(torch.cat([chunk.values for chunk in chunks]))
    ids = torch.cat([chunk.indices for chunk in chunks])
    common = normalize(torch.randn(1, CHANNELS, generator=g), dim=-1)
    atoms = normalize(common + normalize(torch.randn(num_atoms, CHANNELS, generator=g), dim=-1), dim=-1)
    semantics = Semantics(ids, values, atoms, SPACE)
    return replace(scene, semantics=semantics)


def phrases(scene: Scene, count: int, seed: int = 1) -> CompiledQuery:
    """Generated phrases for generated atoms, float64: each near one atom, negatives near none."""
    g = torch.Generator().manual_seed(seed)
    atoms = scene.semantics.dictionary.double()
    chosen = atoms[torch.arange(count) * len(atoms) // count]
    texts = normalize(chosen + 0.3 * _unit(count, atoms.shape[1], g), dim=-1)
    common = normalize(atoms.mean(0), dim=-1)
    negatives = normalize(common + _unit(4, atoms.shape[1], g), dim=-1)
    factor, basis = reduce_dictionary(atoms)
    return CompiledQuery(
        factor,
        texts @ basis.T,
        negatives @ basis.T,
        temperature=10.0,
        threshold=0.6,
        mode="relevancy",
        texts=tuple(f"phrase {i}" for i in range(count)),
        negative_texts=tuple(f"negative {i}" for i in range(4)),
    )


def _unit(count: int, channels: int, g: torch.Generator) -> Tensor:
    return normalize(torch.randn(count, channels, generator=g, dtype=torch.float64), dim=-1)
