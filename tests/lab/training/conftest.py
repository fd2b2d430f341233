"""Four small synthetic rooms for all training tests: coloured boxes before a wall, known exactly.

Tokens are fixed random codes of what a patch shows plus its position, so a head can learn from
them at once; no encoder has to run.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.nn import functional as F

from langflash_core.lab.photos import PhotoFolder, open_folder
from langflash_core.lab.photos.writing import FolderWriter
from langflash_core.lab.training.batches import RoomSet
from langflash_core.lab.training.shards import Label, RoomRecord, quantise_tokens, write_shard
from langflash_core.lab.training.stages.stage import Words
from langflash_core.lab.training.words import PhraseSampler, build_table
from langflash_core.network import MINI, GuidedDepthNet

SIZE = 112  # pixels: a token grid of 8 x 8
TINTS = np.array([[90, 90, 90], [220, 30, 30], [30, 30, 220]], np.uint8)
NAMES = (("plain wall", "wall"), ("wooden floor", "floor"), ("red sofa", "sofa"), ("oak table", "table"))


def encode(phrases: Sequence[str]) -> Tensor:
    """Unit vectors (P, 384) that depend on the last word: "red sofa" and "sofa" are synonyms."""
    seeds = [sum(ord(c) * 31**i for i, c in enumerate(p.split()[-1])) % 2**31 for p in phrases]
    rows = [torch.randn(384, generator=torch.Generator().manual_seed(s)) for s in seeds]
    return F.normalize(torch.stack(rows), dim=-1)


def toy_record(seed: int, views: int = 3) -> RoomRecord:
    """A wall at 4 m, a floor below, two boxes in front; the camera steps aside by 0.1 m a view."""
    generator = torch.Generator().manual_seed(seed)
    left = torch.randint(10, 50, (2,), generator=generator).tolist()
    focal = 100.0
    ids = torch.zeros(views, SIZE, SIZE, dtype=torch.long)
    depths = torch.full((views, SIZE, SIZE), 4.0)
    ids[:, 80:], depths[:, 80:] = 1, 3.0
    for view in range(views):
        for box, (x, z) in enumerate(zip(left, (2.0, 2.5), strict=True)):
            start = x + box * 20 - round(0.1 * view * focal / z)
            columns = slice(max(start, 0), start + 30)
            ids[view, 30 + 20 * box : 75 + 20 * box, columns] = 2 + box
            depths[view, 30 + 20 * box : 75 + 20 * box, columns] = z
    colours = torch.rand(4, 3, generator=generator)
    rgb = (colours[ids].permute(0, 3, 1, 2) * 255).to(torch.uint8)
    viewmats = torch.eye(4).repeat(views, 1, 1)
    viewmats[:, 0, 3] = -0.1 * torch.arange(views)
    Ks = torch.tensor([[focal, 0, SIZE / 2], [0, focal, SIZE / 2], [0, 0, 1]]).repeat(views, 1, 1)
    steps, scales = quantise_tokens(_toy_tokens(ids))
    labels = tuple(Label(name, group) for name, group in NAMES)
    return RoomRecord(seed, rgb, depths.half(), ids.to(torch.uint8), viewmats, Ks, labels, steps, scales)


def _toy_tokens(ids: Tensor) -> Tensor:
    """(V, 4, 64, 384): shares of each thing in a patch, coded at random, and the patch's place."""
    codes = torch.randn(4, 384, generator=torch.Generator().manual_seed(99))
    places = torch.randn(64, 384, generator=torch.Generator().manual_seed(98))
    shares = F.one_hot(ids, 4).float().permute(0, 3, 1, 2)
    patches = F.avg_pool2d(shares, 14).flatten(2).transpose(1, 2)  # (V, 64, 4)
    return (patches @ codes + 0.3 * places)[:, None].repeat(1, 4, 1, 1)


def red_walls(root: Path, count: int, *, labelled: float) -> PhotoFolder:
    """Photos of a wall, red, with a chair, blue, of which a share of the columns is labelled."""
    writer = FolderWriter(root)
    for number in range(1, count + 1):
        labels = np.ones((84, 112), np.int64)
        labels[20:70, 5 * number : 5 * number + 50] = 2
        writer.photo(str(number), TINTS[labels])
        if labelled:
            labels[:, round(labelled * 112) :] = 0
            writer.labels(str(number), labels)
        if labelled == 1:
            writer.depths(str(number), np.full((84, 112), 2.0))
    writer.finish({1: ("wall", None), 2: ("chair", None)} if labelled else {}, "drawn by a test")
    return open_folder(root)


@pytest.fixture(scope="session")
def rooms(tmp_path_factory) -> RoomSet:
    folder: Path = tmp_path_factory.mktemp("rooms")
    write_shard(folder / "a.safetensors", [toy_record(seed) for seed in range(4)])
    return RoomSet(folder)


@pytest.fixture
def words(rooms: RoomSet) -> Words:
    table = build_table(rooms.labels(), encode)
    return Words(PhraseSampler(table), torch.Generator().manual_seed(0))


@pytest.fixture
def network() -> Callable[[], GuidedDepthNet]:
    """Draws a fresh network; heads start alike every time."""

    def draw() -> GuidedDepthNet:
        torch.manual_seed(0)
        return GuidedDepthNet(MINI)

    return draw
