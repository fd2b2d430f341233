"""The measure of level, inventory and plan: a scene that is true is right, one that is wrong is not."""

import json
import math
from dataclasses import replace

import pytest
import torch

from langflash_core.errors import GraphicsError
from langflash_core.geometry.cameras import invert_rigid, transform, unproject
from langflash_core.geometry.quaternions import matrices_to_quats
from langflash_core.geometry.surfels import ellipses, spans
from langflash_core.lab.evaluation import level
from langflash_core.lab.evaluation.level import judge, judge_world, level_markdown, summary, true_unit
from langflash_core.lab.rooms import RoomRenderer, load_pack, staged_room
from langflash_core.language.spaces import language_space
from langflash_core.level import found_world
from langflash_core.types import Gaussians, Record, Scene, Semantics
from tests.lab.rooms.conftest import TINY_PACK

UNIT = 1.7


@pytest.fixture(scope="module")
def staged():
    pack = load_pack(TINY_PACK)
    try:
        drawer = RoomRenderer(pack)
    except GraphicsError as error:
        pytest.skip(str(error))
    with drawer:
        return staged_room(
            900_000_002, pack, drawer, num_views=2, size=(112, 112), libraries=("BlendSwap-CC-0",)
        )


@pytest.fixture(scope="module")
def scene(staged):
    """Every pixel of the photos a Gaussian in its true place, called what it is; a unit is 1.7 m."""
    views, parts = staged.views, []
    groups = sorted({group for group in views.groups if group})
    for view in range(2):
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
    return Scene(
        gaussians, Semantics(named[:, None], torch.ones(count, 1), atoms, "minilm"), viewmats,
        torch.from_numpy(views.Ks), (112, 112), view_ids=view_ids, record=Record(preset="mini"),
    )  # fmt: skip


def _scaled(viewmat: torch.Tensor) -> torch.Tensor:
    scaled = viewmat.clone()
    scaled[:3, 3] /= UNIT
    return scaled


@pytest.fixture(scope="module")
def judged(scene, staged):
    return judge(1, scene, staged)


def test_a_true_scene_is_right(scene, staged, judged):
    assert true_unit(scene, staged) == pytest.approx(UNIT, rel=0.01)
    numbers = judged.numbers
    assert numbers["up_error"] < 1.5 and abs(numbers["floor_error"]) < 0.05
    assert numbers["precision_any_name"] >= numbers["precision"] > 0.7
    assert numbers["recall_any_name"] >= numbers["recall"] > 0.7
    assert judged.walls and max(judged.walls) < level.WALLS and numbers["wall_recall"] == 1


def test_wrong_names_wrong_up_and_wrong_lengths_are_told(scene, staged, judged):
    none = scene.semantics.dictionary.roll(3, 0)
    misnamed = replace(scene, semantics=replace(scene.semantics, dictionary=none))
    assert judge(1, misnamed, staged).numbers["precision"] < judged.numbers["precision"]
    world = found_world(scene, up=(0.3, -1.0, 0.0))
    numbers = judge_world(scene, world, UNIT, staged)
    assert numbers["up_error"] > 5 and numbers["up_right"] == 0
    said = judge_world(scene, found_world(scene), 3 * UNIT, staged)
    assert math.isnan(said["length_error"]) or said["length_right"] == 0


def test_a_summary_and_its_table_hold_every_number(judged):
    found = summary([judged, judged])
    assert found["rooms"] == 2 and found["walls_found"] == 2 * len(judged.walls)
    assert json.dumps(found, allow_nan=False)
    table = level_markdown({"summary": found})
    assert "Up within 1 degree" in table and "| Rooms | 2 |" in table
