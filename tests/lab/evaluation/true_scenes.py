"""Scenes that are true: what the photos of a rendered room show, where it is."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import torch

from langflash_core.errors import GraphicsError
from langflash_core.geometry.cameras import invert_rigid, transform, unproject
from langflash_core.geometry.quaternions import matrices_to_quats
from langflash_core.geometry.surfels import ellipses, spans
from langflash_core.lab.rooms import RoomRenderer, StagedRoom, load_pack, staged_room
from langflash_core.language.spaces import language_space
from langflash_core.types import Gaussians, Record, Scene, Semantics
from tests.lab.rooms.conftest import TINY_PACK

UNIT = 1.7


@contextmanager
def staged(seed: int, photos: int, side: int) -> Iterator[tuple[StagedRoom, RoomRenderer]]:
    """A room of the tiny pack in square photos, and what draws it; skips where there is no OpenGL."""
    pack = load_pack(TINY_PACK)
    try:
        drawer = RoomRenderer(pack)
    except GraphicsError as error:
        pytest.skip(str(error))
    libraries = ("BlendSwap-CC-0",)
    with drawer:
        yield (
            staged_room(seed, pack, drawer, num_views=photos, size=(side, side), libraries=libraries),
            drawer,
        )


def true_scene(staged: StagedRoom) -> Scene:
    """Every pixel of the photos a Gaussian in its true place, called what it is; a unit is `UNIT` metres."""
    views, parts = staged.views, []
    groups = sorted({group for group in views.groups if group})
    for view in range(len(views.images)):
        depths, K = torch.from_numpy(views.depths[view]), torch.from_numpy(views.Ks[view])
        pos_c = unproject(depths, K) / UNIT
        footprint = depths / K[0, 0] / UNIT
        axes, sides = ellipses(*spans(pos_c, footprint))
        pose = invert_rigid(_scaled(torch.from_numpy(views.viewmats[view])))
        ids = torch.from_numpy(views.instances[view]).long()
        known = (depths > 0) & (ids > 0)
        named = torch.tensor([groups.index(group) if group else 0 for group in views.groups])[ids]
        scales = torch.cat((sides, 0.1 * sides[..., 1:]), -1).clamp_min(1e-4)
        parts.append(
            (
                transform(pose, pos_c[known]), pose[:3, :3] @ axes[known], 0.5 * scales[known], named[known],
                torch.full((int(known.sum()),), view),
            )
        )  # fmt: skip
    means, axes, scales, named, view_ids = (torch.cat(each) for each in zip(*parts, strict=True))
    count = len(means)
    gaussians = Gaussians(
        means, matrices_to_quats(axes), scales, torch.full((count,), 0.9), torch.zeros(count, 1, 3)
    )
    atoms = language_space("minilm").encode(groups)
    viewmats = torch.stack([_scaled(torch.from_numpy(each)) for each in views.viewmats])
    size = (views.images.shape[2], views.images.shape[1])
    return Scene(
        gaussians, Semantics(named[:, None], torch.ones(count, 1), atoms, "minilm"), viewmats,
        torch.from_numpy(views.Ks), size, view_ids=view_ids, record=Record(preset="mini"),
    )  # fmt: skip


def _scaled(viewmat: torch.Tensor) -> torch.Tensor:
    scaled = viewmat.clone()
    scaled[:3, 3] /= UNIT
    return scaled
