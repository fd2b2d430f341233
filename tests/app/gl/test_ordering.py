"""Orders found beside the frames: exact ones are exact, late ones never too late and close."""

import dataclasses
from concurrent.futures import Future

import numpy as np
import pytest
import torch

from app.bench.generated import room
from app.gl import SplatRenderer, ordering
from app.gl.ordering import MARGIN, MOST_BEHIND, Ordering, Places, depth_keys, exact_order, quick_order, sees
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.types import Camera
from tests.splat.scenes import camera, cloud

SIZE = (160, 120)
SMALL_TURN, LARGE_TURN = 0.5, 20.0  # degrees a frame; `MARGIN` of this lens is some 5
ASIDE = 8.0  # degrees; straight on, the order of a whole wall is that of its noise
LEAST_DB = 40.0  # of late pictures of the room: a difference that shows only beside the other


def turned(seen: Camera, degrees: float) -> Camera:
    angle = np.radians(degrees)
    turn = torch.eye(4, dtype=seen.viewmat.dtype)
    turn[0, 0] = turn[2, 2] = float(np.cos(angle))
    turn[0, 2], turn[2, 0] = float(np.sin(angle)), -float(np.sin(angle))
    return dataclasses.replace(seen, viewmat=turn @ seen.viewmat)


def along(seen: Camera, way: float) -> Camera:
    pose = invert_rigid(seen.viewmat)
    pose[:3, 3] += way * pose[:3, 2]
    return dataclasses.replace(seen, viewmat=invert_rigid(pose))


@pytest.fixture(scope="module")
def many():
    """More Gaussians than are looked at at once, some of them twice in the same place."""
    scene = room(70_000, SIZE)
    means = scene.gaussians.means.clone()
    means[65_000:] = means[:5_000]
    return dataclasses.replace(scene, gaussians=dataclasses.replace(scene.gaussians, means=means))


@pytest.fixture
def places(many) -> Places:
    gaussians = many.gaussians
    return Places(
        np.ascontiguousarray(gaussians.means.numpy().T),
        gaussians.scales.amax(-1).numpy(),
        np.ones(len(gaussians.means), bool),
    )


def depths_of(many, seen: Camera) -> np.ndarray:
    x, y, z = many.gaussians.means.double().numpy().T
    row = seen.viewmat.double().numpy()[2]
    return x * row[0] + y * row[1] + z * row[2] + row[3]


def test_an_exact_order_is_by_depth_and_then_by_row(many, places):
    seen = turned(many.camera(0, *SIZE), 15)
    order = exact_order(places, seen)
    rows = np.sort(order.rows)
    depths = depths_of(many, seen)[rows]
    assert 10_000 < len(rows) < 70_000  # the turn leaves some beside the image
    np.testing.assert_array_equal(order.rows[::-1], rows[np.argsort(depths, kind="stable")])
    assert order.depth_range is not None
    np.testing.assert_allclose(order.depth_range, np.quantile(depths, (0.02, 0.98)), rtol=1e-3)


def test_what_is_hidden_is_in_no_order(many, places):
    hidden = dataclasses.replace(places, shown=np.arange(70_000) % 2 == 0)
    for find in (exact_order, quick_order):
        assert not (find(hidden, many.camera(0)).rows % 2).any()
    none = dataclasses.replace(places, shown=np.zeros(70_000, bool))
    assert exact_order(none, many.camera(0)).depth_range is None


def test_keys_tell_what_they_say():
    depths = np.sort(np.random.default_rng(0).uniform(0.3, 16 * 0.3, 20_000))
    keys = depth_keys(depths)
    assert keys.dtype == np.uint16 and (np.diff(keys.astype(int)) >= 0).all()
    apart = np.stack((depths, depths * (1 + 1 / 8000)), 1)
    both = depth_keys(apart.ravel()).reshape(-1, 2).astype(int)
    assert (both[:, 1] > both[:, 0]).all()
    assert len(depth_keys(np.zeros(0))) == 0


def test_a_quick_order_has_what_is_around_the_image(many, places):
    seen = many.camera(0, *SIZE)
    order = quick_order(places, seen)
    depths = depths_of(many, seen)[order.rows]
    assert (depths[1:] <= depths[:-1] * (1 + 1 / 4000)).all()  # keys may be as coarse as two steps
    for moved in (turned(seen, 2), turned(seen, -2), along(seen, -0.03)):
        assert sees(seen, moved, order.depth_range, MARGIN)  # pyright: ignore[reportArgumentType]
        assert np.isin(exact_order(places, moved).rows, order.rows).mean() > 0.999  # nearer than 2 % of them


@pytest.mark.parametrize("away", [0.0, 1e4], ids=["here", "far from the origin"])
@pytest.mark.parametrize("flat", [False, True], ids=["lens", "orthographic"])
def test_a_quick_order_leaves_out_none_that_an_exact_one_has(many, places, flat, away):
    seen = turned(many.camera(0, *SIZE), 15)
    if flat:
        seen = dataclasses.replace(seen, K=seen.K * torch.tensor([0.3, 0.3, 1.0])[:, None], orthographic=True)
    pose = invert_rigid(seen.viewmat.double())
    pose[0, 3] += away
    seen = dataclasses.replace(seen, viewmat=invert_rigid(pose))
    moved = places.means + np.array([[away], [0], [0]], np.float32)
    places = dataclasses.replace(places, means=moved)
    exact, quick = exact_order(places, seen), quick_order(places, seen)
    assert 1_000 < len(exact.rows) < 70_000
    missing = np.setdiff1d(exact.rows, quick.rows)
    assert len(missing) <= (0 if away == 0 else 2)  # beside the near plane, where float32 ends at .001
    row = seen.viewmat.numpy()[2]
    z = (row[:3] @ moved.astype(np.float64) + row[3])[quick.rows]
    assert (z[1:] <= z[:-1] * (1 + 1 / 4000)).all()


def test_what_a_camera_sees(many):
    seen, depths = many.camera(0, *SIZE), (1.0, 4.0)
    assert sees(seen, seen, depths, 0.0)
    assert not sees(seen, turned(seen, 1), depths, 0.0)
    assert sees(seen, turned(seen, 2), depths, MARGIN)
    assert not sees(seen, turned(seen, LARGE_TURN), depths, MARGIN)
    assert not sees(seen, turned(seen, 180), depths, MARGIN)
    assert sees(seen, along(seen, 0.5), depths, 0.0)  # towards what is there
    assert not sees(seen, along(seen, -1), depths, MARGIN)
    assert sees(seen, seen.with_size(80, 60), depths, 1e-3)
    wider = dataclasses.replace(seen, K=seen.K * torch.tensor([0.5, 0.5, 1.0])[:, None])
    assert not sees(seen, wider, depths, MARGIN)
    flat = dataclasses.replace(seen, orthographic=True)
    assert not sees(seen, flat, depths, MARGIN) and sees(flat, flat, depths, 0.0)
    assert not sees(flat, turned(flat, 90), depths, MARGIN)


class Waiting(Future):
    """Found only when it is waited for."""

    def __init__(self, work):
        super().__init__()
        self.work = work

    def result(self, timeout=None):
        if not self.done():
            self.set_result(self.work())
        return super().result(timeout)


class Threads:
    """An executor that is never, or always, done before it is asked."""

    def __init__(self, at_once: bool):
        self.at_once = at_once

    def submit(self, find, *given):
        job = Waiting(lambda: find(*given))
        if self.at_once:
            job.result()
        return job


@pytest.fixture(params=[False, True], ids=["slow", "quick"])
def beside(request, monkeypatch) -> Threads:
    threads = Threads(request.param)
    monkeypatch.setattr(ordering, "_threads", lambda: threads)
    return threads


def test_an_order_is_never_later_than_it_may_be(many, beside):
    followed = Ordering(many.gaussians.means, many.gaussians.scales)
    cameras = [turned(many.camera(0, *SIZE), SMALL_TURN * frame) for frame in range(10)]
    ages = []
    for frame, seen in enumerate(cameras):
        assert not followed.follow(seen)
        held = followed._held
        assert held is not None
        ages.append(frame - next(n for n, each in enumerate(cameras) if each is held.camera))
    assert ages[0] == 0 and max(ages) == (1 if beside.at_once else MOST_BEHIND)


def test_a_camera_that_jumps_waits_for_its_order(many, places, beside):
    followed = Ordering(many.gaussians.means, many.gaussians.scales)
    seen = many.camera(0, *SIZE)
    followed.follow(seen)
    followed.follow(turned(seen, SMALL_TURN))
    jumped = turned(seen, LARGE_TURN)
    followed.follow(jumped)
    np.testing.assert_array_equal(followed.order, quick_order(places, jumped).rows)


def test_other_gaussians_have_no_order_from_before(many, beside):
    followed = Ordering(many.gaussians.means, many.gaussians.scales)
    seen = many.camera(0, *SIZE)
    followed.follow(seen)
    shown = np.arange(70_000) % 2 == 0
    assert followed.show(shown) and not followed.show(shown.copy())
    followed.follow(turned(seen, SMALL_TURN))
    assert len(followed.order) and not (followed.order % 2).any()
    followed.place(many.gaussians.means + 100, many.gaussians.scales)
    followed.follow(seen)
    assert len(followed.order) == 0


def test_an_exact_order_can_be_found_beside(many, places, monkeypatch):
    monkeypatch.setattr(ordering, "_threads", lambda: Threads(False))
    sought = Ordering(many.gaussians.means, many.gaussians.scales)
    seen = many.camera(0, *SIZE)
    assert not sought.found(seen) and not sought.found(seen)
    job = sought._job
    sought.sort(seen)  # waits for it
    assert sought._held is job
    np.testing.assert_array_equal(sought.order, exact_order(places, seen).rows)
    assert not sought.found(seen)
    sought.sort(turned(seen, 3))  # another camera than the one sought
    np.testing.assert_array_equal(sought.order, exact_order(places, turned(seen, 3)).rows)


def test_few_are_ordered_at_once():
    scene = cloud(50, 2)
    few = Ordering(scene.gaussians.means.float(), scene.gaussians.scales.float())
    assert few.found(camera()) and few.follow(camera()) and few._job is None


# --- drawn ------------------------------------------------------------------------------------


@pytest.fixture
def both(gl, many):
    made = SplatRenderer(gl, "float32"), SplatRenderer(gl, "float32")
    for renderer in made:
        renderer.set_scene(many)
    yield made
    for renderer in made:
        renderer.release()


def test_late_pictures_are_close_and_resting_ones_exact(both, many, monkeypatch):
    monkeypatch.setattr(ordering, "_threads", lambda: Threads(False))  # as late as may be
    late, true = both
    worst = np.inf
    for frame in range(4):
        seen = turned(many.camera(0, *SIZE), ASIDE + SMALL_TURN * frame)
        late.draw(seen, weight_maps=False, late=True)
        true.draw(seen, weight_maps=False)
        assert true.exact and not late.exact
        square = (late.frame().rgb - true.frame().rgb).square().mean()
        worst = min(worst, float(-10 * square.log10()))
    assert LEAST_DB < worst < np.inf  # another order it is
    assert not late.upload(seen)
    late.draw(seen, weight_maps=False)
    assert late.exact and torch.equal(late.frame().rgb, true.frame().rgb)
    assert late.depth_range == true.depth_range


def test_what_a_late_order_brings_behind_the_camera_is_not_drawn(show):
    scene = cloud(60, 2, dtype=torch.float32)
    renderer = show(scene, "float32")
    seen = camera()
    past = along(seen, 1e3)
    assert renderer._scene is not None
    level = renderer._scene.whole
    level.prepare(past)
    (part,) = level.parts
    part.splats.draw_in(np.arange(part.splats.num_gaussians, dtype=np.uint32))
    part.splats.project(past)
    renderer.draw(past, weight_maps=False)
    assert float(renderer.frame().alphas.max()) == 0
