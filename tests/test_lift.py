"""Language for plain splats: what views say of pixels comes to the Gaussians that show them."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch

from langflash_core.errors import Cancelled, InputError
from langflash_core.geometry.rotations import matrix
from langflash_core.lift import LIFTING, UPS, lift, likeness, own_cameras, own_views
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.checks import check_scene
from langflash_core.splat import rasterize, render
from langflash_core.splat.backprojection import backproject
from langflash_core.types import Camera, Frame, Gaussians, Scene
from tests.app.cli.conftest import stripes
from tests.export.splats import random_gaussians


def small_camera() -> Camera:
    K = torch.tensor([[30.0, 0, 16], [0, 30.0, 12], [0, 0, 1]])
    viewmat = torch.eye(4)
    viewmat[2, 3] = 5
    return Camera(viewmat, K, 32, 24)


def test_gathering_is_the_transpose_of_splatting():
    """Twin: the gradient of sum_p m(p) (sum_i c_ip w_i)(p) by w_i is sum_p c_ip m(p)."""
    gaussians, camera = random_gaussians(80), small_camera()
    gaussians = replace(gaussians, scales=gaussians.scales.clamp(0.02, 0.5))
    rng = torch.Generator().manual_seed(0)
    values = torch.rand(24, 32, 3, generator=rng)
    trust = (torch.rand(24, 32, generator=rng) > 0.3).float()
    features = torch.zeros(80, 3, dtype=torch.float64, requires_grad=True)
    doubled = gaussians.map(lambda v: v.double())
    maps, _ = rasterize(doubled, features, camera)
    (maps * (values * trust[..., None])).sum().backward()
    sums, totals = backproject(gaussians, camera, values, trust)
    assert features.grad is not None
    assert torch.allclose(sums.double(), features.grad, atol=1e-4)
    ones, _ = backproject(gaussians, camera, torch.ones(24, 32, 1), trust)
    assert torch.allclose(ones[:, 0], totals)
    assert float(totals.max()) > 1  # some Gaussian is seen by more than a pixel's worth


def test_values_of_another_size_are_refused(unchecked):
    with pytest.raises(ValueError, match="values: expected"):
        backproject(random_gaussians(3), small_camera(), torch.zeros(24, 31, 2))
    with pytest.raises(ValueError, match="trust: expected"):
        backproject(random_gaussians(3), small_camera(), torch.zeros(24, 32, 2), torch.zeros(3, 3))


@pytest.fixture
def known_network(monkeypatch) -> Scene:
    """A network that sees, in every view, what a wall with three stripes truly shows there."""
    whole = stripes()

    named = SimpleNamespace(calibration={"threshold": 0.5})

    def seen(network, views, viewmats, depths):
        assert torch.allclose(viewmats[0], torch.eye(4), atol=1e-5)  # the world of the first view
        assert views.images.shape[0] == len(viewmats) == len(depths)
        frames = [render(whole, camera) for camera in cameras]
        maps = torch.stack([f.weight_maps for f in frames if f.weight_maps is not None]).permute(0, 3, 1, 2)
        return maps, whole.semantics.dictionary

    cameras = ring()
    monkeypatch.setattr("langflash_core.lift.load_network", lambda *_, **__: named)
    monkeypatch.setattr("langflash_core.lift.posed_semantics", seen)
    monkeypatch.setattr("langflash_core.lift.own_cameras", lambda *_: cameras)
    return whole


def ring() -> list[Camera]:
    """Four cameras before the wall, that look at its middle from aside."""
    cameras = []
    for angle in (-0.5, -0.15, 0.2, 0.6):
        turn, middle = torch.eye(4), torch.tensor([0.0, 0.0, 1.0])
        turn[:3, :3] = torch.from_numpy(matrix((math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0))).float()
        turn[:3, 3] = torch.tensor([0.0, 0.0, 1.4]) - turn[:3, :3] @ middle
        K = torch.tensor([[90.0, 0, 64], [0, 90.0, 48], [0, 0, 1]])
        cameras.append(Camera(turn, K, 128, 96))
    return cameras


def test_a_plain_wall_gets_its_stripes_back(known_network):
    plain = bare_scene(known_network.gaussians, "wall.ply")
    steps = []
    lifted = lift(plain, progress=lambda name, _: steps.append(name))
    check_scene(lifted)
    assert lifted.num_views == 4 == len(lifted.photos) and lifted.semantics.space == "minilm"
    assert torch.equal(lifted.semantics.dictionary, known_network.semantics.dictionary)
    truth = known_network.semantics.dense_weights().argmax(-1)
    right = (lifted.semantics.dense_weights().argmax(-1) == truth).float().mean()
    assert float(right) > 0.97  # at the borders a pixel shows two stripes
    assert lifted.record.calibration == {"threshold": 0.5} and lifted.record.warnings == ()
    assert steps[-1] == "done" and {"drawing", "network", "carrying back"} < set(steps)


def test_what_no_view_shows_takes_the_nearest(known_network):
    """A second wall hidden far behind: each of its Gaussians speaks as the front one before it."""
    front = known_network.gaussians
    behind = replace(front, means=front.means + torch.tensor([0.0, 0, 0.05]))
    both = Gaussians(
        *(torch.cat(pair) for pair in zip(vars(front).values(), vars(behind).values(), strict=True))
    )
    both = replace(both, opacities=torch.cat((torch.full((len(front),), 0.99), behind.opacities)))
    lifted = lift(bare_scene(both, "walls.ply"))
    assert bool((lifted.semantics.weight_values.sum(-1) > 0.99).all())


def test_views_that_show_nothing_are_refused(known_network):
    gaussians = replace(known_network.gaussians, opacities=torch.full((len(known_network.gaussians),), 1e-3))
    with pytest.raises(InputError, match="almost nothing"):
        lift(bare_scene(gaussians, "mist.ply"))


@pytest.mark.parametrize(("up", "other"), [("-y", "y"), ("z", "-z"), ("x", "-x")])
def test_a_scene_on_its_head_is_told_the_other_way_up(known_network, monkeypatch, up, other):
    asked = []

    def hangs(scene, upward):
        asked.append(upward.tolist())
        return True

    monkeypatch.setattr("langflash_core.lift.on_its_head", hangs)
    lifted = lift(bare_scene(known_network.gaussians, "wall.ply"), up=up)
    expected = [0.0, 0.0, 0.0]
    expected["xyz".index(up[-1])] = -1.0 if up.startswith("-") else 1.0
    assert asked == [expected]
    assert f"--up={other}," in lifted.record.warnings[-1]


def test_lifting_stops_when_asked(known_network):
    with pytest.raises(Cancelled):
        lift(bare_scene(known_network.gaussians, "wall.ply"), cancelled=lambda: True)


@pytest.mark.parametrize("up", UPS)
def test_the_axis_that_points_up_is_up_in_every_view(up):
    whole = bare_scene(stripes().gaussians, "wall.ply")
    upward = torch.zeros(3)
    upward["xyz".index(up[-1])] = -1.0 if up.startswith("-") else 1.0
    cameras = own_cameras(whole, LIFTING.views, up)
    assert 0 < len(cameras) <= LIFTING.views
    for camera in cameras:
        turn = camera.viewmat[:3, :3]
        assert torch.allclose(turn @ turn.T, torch.eye(3), atol=1e-5)  # of float32
        assert float(torch.linalg.det(turn)) > 0  # no mirror
        in_view = turn @ upward
        assert float(in_view[1]) < -0.8 and abs(float(in_view[0])) < 1e-5  # a little down at most


def checks(shift: float = 0.0) -> torch.Tensor:
    """(48, 64, 3): a pattern without a period, moved to the right by pixels."""
    xs, ys = torch.meshgrid(torch.arange(64.0) - shift, torch.arange(48.0), indexing="xy")
    grey = 0.5 + 0.2 * torch.sin(xs / 3 + (ys / 9) ** 2 / 4) + 0.2 * torch.sin(ys / 4 - (xs / 11) ** 2)
    return grey[..., None].expand(48, 64, 3)


def drawn(rgb: torch.Tensor, alphas: torch.Tensor | None = None) -> Frame:
    alphas = torch.ones(48, 64) if alphas is None else alphas
    return Frame(rgb * alphas[..., None], alphas, torch.ones(48, 64))


def test_a_view_is_like_its_photo_and_no_other():
    photo = checks().permute(2, 0, 1)
    assert likeness(drawn(checks()), photo) == pytest.approx(1, abs=1e-5)
    assert likeness(drawn(0.3 * checks() + 0.1), photo) == pytest.approx(1, abs=1e-5)  # another light
    assert likeness(drawn(1 - checks()), photo) == pytest.approx(-1, abs=1e-5)
    assert likeness(drawn(checks(1)), photo) > 0.6  # a pose that is a pixel off
    assert likeness(drawn(checks().flip(1)), photo) < 0.3  # mirrored
    half = torch.ones(48, 64)
    half[:, 32:] = 0.2
    assert likeness(drawn(checks(), half), photo) == pytest.approx(1, abs=1e-5)  # its border is none
    for nothing in (drawn(checks(), torch.zeros(48, 64)), drawn(torch.full((48, 64, 3), 0.4))):
        assert math.isnan(likeness(nothing, photo))


def test_photos_that_do_not_look_like_the_scene_are_said(known_network):
    cameras = ring()
    plain = bare_scene(known_network.gaussians, "wall.ply")
    views = own_views([render(plain, camera) for camera in cameras], cameras)
    viewmats = torch.stack([camera.viewmat for camera in cameras])
    assert not lift(plain, views, viewmats).record.warnings
    wrong = replace(views, images=1 - views.images)
    (said,) = lift(plain, wrong, viewmats).record.warnings
    assert "do not look like the scene" in said and "; " in said
    assert not lift(plain).record.warnings  # views of itself


def test_layers_stay_layers_and_each_gets_its_stripes_back(known_network):
    count = len(known_network.gaussians)
    twice = known_network.rows(torch.arange(count).repeat(2))
    ids = torch.arange(2).repeat_interleave(count)
    bare = replace(bare_scene(twice.gaussians, "walls.ply"), viewmats=twice.viewmats, Ks=twice.Ks)
    layers = replace(bare, view_size=twice.view_size, view_ids=ids).with_record(layered=True)
    lifted = lift(layers)
    check_scene(lifted)
    assert lifted.layered and torch.equal(lifted.viewmats, layers.viewmats)
    assert lifted.view_ids is not None and torch.equal(lifted.view_ids, ids)
    truth = twice.semantics.dense_weights().argmax(-1)
    right = lifted.semantics.dense_weights().argmax(-1) == truth
    for view in range(2):
        assert float(right[ids == view].float().mean()) > 0.97  # at the borders a pixel shows two stripes
