"""What is around a camera: distances and known shares before a wall, and in a small room."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry import poses
from langflash_core.geometry.nearness import Nearness
from langflash_core.geometry.poses import Pose, Vector, from_view
from langflash_core.scene.settings import SURROUNDINGS
from langflash_core.scene.surroundings import Surroundings, surroundings_of
from langflash_core.types import Scene
from tests.app.window.scenes import room

FAR, SPACING = 2.0, 0.05


@pytest.fixture
def wall() -> Surroundings:
    """A wall across the view of a photo at the origin, to 4 on both sides."""
    steps = np.arange(-4, 4, SPACING) + SPACING / 2
    x, y = (grid.ravel() for grid in np.meshgrid(steps, steps))
    places = np.stack((x, y, np.full(len(x), FAR)), 1)
    rows = np.arange(len(x))
    return Surroundings(places, np.zeros_like(places), np.full(len(x), SPACING), rows, rows % 2, FAR)


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Of two photos, each with half of the Gaussians."""
    made = room(torch.eye(3))
    return replace(made, view_ids=torch.arange(len(made.gaussians)) % 2)


def at_photo(scene: Scene, view: int) -> Pose:
    viewmat, K = scene.viewmats[view].double().numpy(), scene.Ks[view].double().numpy()
    return from_view(viewmat, K, scene.view_size, 1.0)


def test_the_nearest_surface_is_as_far_as_it_is(wall: Surroundings) -> None:
    for place in ([0.0, 0.0, 0.8], [0.3, 0.1, 1.7], [-0.2, 0.1, -1.0]):
        found, way = wall.nearest(np.array(place))
        true = FAR - place[2]
        # The next sample is half a spacing aside on both axes, at the most.
        assert true <= found <= math.hypot(true, SPACING / math.sqrt(2)) + 1e-9
        assert np.linalg.norm(way) == pytest.approx(found) and way[2] == pytest.approx(true)


def test_a_surface_is_there_from_its_photos_side_alone(wall: Surroundings) -> None:
    """Who comes back through a wall is not held by its back, and sees nothing that is known."""
    # From .1 behind it only what is far aside still faces one, beyond a right angle.
    assert wall.nearest(np.array([0.0, 0.0, FAR - 0.1]))[0] < 0.11
    assert wall.nearest(np.array([0.0, 0.0, FAR + 0.1]))[0] > math.sqrt(0.1 * FAR)
    behind = poses.facing(Pose(Vector(0.0, 0.0, 1.0), reach=1.0), Vector(0.0, 0.0, -1.0))
    assert wall.known(replace(behind, centre=Vector(0.0, 0.0, 2 * FAR))) == 0


def test_what_is_seen_from_far_aside_is_not_known(wall: Surroundings) -> None:
    """The wall from 50 degrees aside, and from 70, where some of it lies at less."""
    known = []
    for degrees in (0, 50, 70):
        pose = poses.orbit(Pose(reach=FAR, fov=15.0), math.radians(degrees), 0.0)
        known.append(wall.known(pose))
    assert known[0] == 1 and known[1] > 0.9 and known[2] < 0.5


def test_a_photos_own_picture_is_known_and_what_is_behind_it_is_not(scene: Scene) -> None:
    around = surroundings_of(scene)
    assert around is not None
    for view in (0, 1):
        home = at_photo(scene, view)
        half = poses.look(home, math.radians(home.fov) / 2, 0.0)
        assert around.known(home) > 0.95 and around.known(poses.look(home, math.pi, 0.0)) == 0
        # Half of it is out of sight; from beside, the other photo shows a part of that.
        assert 0.4 < around.known(half) < 0.75


def strip_beside(wall: Surroundings) -> Surroundings:
    """The wall, and before it what a photo at the origin saw along its own way: a surface at 0.5 to the right
    that runs into the depth. Its samples are of view 5."""
    y, z = (grid.ravel() for grid in np.meshgrid(np.arange(-2, 2, SPACING), np.arange(0.5, 1.5, SPACING)))
    places = np.stack((np.full(len(y), 0.5), y, z), 1)
    count = len(wall.places) + len(places)
    return replace(
        wall,
        places=np.concatenate((wall.places, places)),
        eyes=np.zeros((count, 3)),
        sizes=np.full(count, SPACING),
        rows=np.arange(count),
        views=np.concatenate((0 * wall.views, np.full(len(places), 5))),
    )


def test_what_is_seen_from_far_aside_hides_what_lies_behind_it(wall: Surroundings) -> None:
    """From the right, where the photo's surface turns its back, the wall behind it is no longer seen."""
    both, there = strip_beside(wall), Pose(Vector(1.5, 0.0, 0.5), fov=40.0)
    across = poses.facing(replace(there, reach=1.0), Vector(-1.0, 0.0, 0.8))
    across = replace(across, centre=there.centre)
    assert wall.known(across) > 0.9 and both.known(across) < 0.5
    ahead = Pose(fov=20.0)
    assert wall.known(ahead) == both.known(ahead) == 1


def test_what_one_of_several_layers_hides_the_others_show(wall: Surroundings) -> None:
    """As it does in the picture, which blends layers by what they agree about."""
    both, here = strip_beside(wall), Vector(1.5, 0.0, 0.5)
    across = replace(poses.facing(Pose(here, reach=1.0, fov=40.0), Vector(-1.0, 0.0, 0.8)), centre=here)
    turned = across.axes[:, 2]
    many = np.where(both.views == 5, 5, np.arange(len(both.views)) % 3)
    at = np.tile(np.array(here), (6, 1)) + np.array([[0, 0, 0.01 * n] for n in (0, 0, 0, 9, 9, 1)])
    layers = Nearness(at, np.tile(turned, (6, 1)), FAR, tuple(range(6)))
    assert replace(both, views=many, layers=layers).known(across) > 0.9
    alone = Nearness(at[5:], np.tile(turned, (1, 1)), FAR, (5,))
    assert replace(both, views=many, layers=alone).known(across) == 0


def test_of_layers_those_that_a_picture_shows_are_known(wall: Surroundings) -> None:
    """As the renderer chooses them: six photos in a row, of which the left half saw the wall."""
    at = np.stack((np.arange(6.0), np.zeros(6), np.zeros(6)), 1)
    layers = Nearness(at, np.tile([0.0, 0.0, 1.0], (6, 1)), FAR, tuple(range(6)))
    left = replace(wall, views=wall.rows % 3, layers=layers)
    for place, known in ((0.0, True), (2.0, True), (5.0, False)):
        pose = Pose(Vector(place, 0.0, 0.0))
        assert (left.known(pose) > replace(left, layers=None).known(pose) / 2) == known


def test_samples_are_as_wide_as_their_cells_however_near_one_comes(wall: Surroundings) -> None:
    sparse = wall.of(np.arange(len(wall.places)) % 7 == 0)
    wide = replace(sparse, sizes=7 * sparse.sizes)
    near = Pose(Vector(0.0, 0.0, FAR - 0.4))
    assert sparse.known(near) < 0.8 < 0.95 < wide.known(near)


def test_the_middle_of_what_is_near_is_nearer_than_the_middle(scene: Scene) -> None:
    around, home = surroundings_of(scene), at_photo(scene, 0)
    assert around is not None
    depth = around.middle(home)
    assert depth is not None and around.nearest(np.zeros(3))[0] < depth < around.depth
    assert around.middle(poses.look(home, math.pi, 0.0)) is None


def test_samples_are_few_and_of_their_photos(scene: Scene) -> None:
    around = surroundings_of(scene)
    assert around is not None and 100 < len(around.places) <= min(
        SURROUNDINGS.most, 2 * len(SURROUNDINGS.quantiles) * SURROUNDINGS.a_photo
    )
    np.testing.assert_array_equal(around.places, scene.gaussians.means.double().numpy()[around.rows])
    np.testing.assert_allclose(around.eyes[:, 0], 0.3 * (around.rows % 2), atol=1e-6)
    distances = np.linalg.norm(around.places - around.eyes, axis=1)
    assert around.depth == pytest.approx(np.median(distances))


def test_what_is_gone_holds_nobody(wall: Surroundings) -> None:
    none = wall.of(np.zeros(len(wall.places), bool))
    assert none.nearest(np.zeros(3))[0] == math.inf and none.known(Pose()) == 0
    assert none.middle(Pose()) is None and none.depth == wall.depth


def test_nothing_is_known_of_scenes_without_photos(scene: Scene) -> None:
    assert surroundings_of(replace(scene, view_ids=None)) is None
    nobody = torch.full((len(scene.gaussians),), -1)
    assert surroundings_of(replace(scene, view_ids=nobody)) is None
