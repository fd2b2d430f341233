"""Pictures of rooms: depth against rays, reprojection, ids, determinism."""

import dataclasses

import numpy as np
import pytest

from langflash_core.lab.rooms import HELD_OUT_LIBRARIES, Pack, RoomRenderer, make_room, staged_room
from langflash_core.lab.rooms.cameras import propose_cameras, reproject
from tests.lab.rooms.reference import cast_ray, room_triangles

SIZE = (112, 112)


@pytest.fixture(scope="module")
def samples(pack: Pack, renderer: RoomRenderer):
    return [
        staged_room(seed, pack, renderer, size=SIZE, libraries=HELD_OUT_LIBRARIES).views for seed in range(6)
    ]


def test_depth_and_ids_match_rays(pack: Pack, renderer: RoomRenderer) -> None:
    rng = np.random.default_rng(3)
    room, cameras = None, None
    for seed in range(20):
        room = make_room(seed, pack, HELD_OUT_LIBRARIES)
        cameras = propose_cameras(rng, room, 1, SIZE)
        if cameras is not None:
            break
    assert room is not None and cameras is not None
    renderer.set_room(room)
    view, K = cameras.viewmats[0], cameras.Ks[0]
    picture = renderer.draw(view, K, SIZE)
    triangles, ids = room_triangles(room, pack)
    eye = -view[:3, :3].T @ view[:3, 3]
    errors, same = [], []
    for row, column in rng.integers(0, SIZE[0], (150, 2)):
        ray = view[:3, :3].T @ np.linalg.inv(K) @ [column + 0.5, row + 0.5, 1.0]
        depth, number = cast_ray(triangles, ids, eye, ray)
        same.append(number == picture.ids[row, column])
        if same[-1] and depth > 0:
            errors.append(abs(picture.depth[row, column] - depth) / depth)
    # Rays exactly on an edge, and panes (thinned in the picture, solid for rays), may differ.
    assert np.mean(same) > 0.93
    assert len(errors) > 100
    assert np.quantile(errors, 0.98) < 1e-4  # float32 depth


def test_depth_reprojects(samples) -> None:
    for views in samples:
        z, u, v, valid = reproject(
            views.depths[1], views.viewmats[[1, 0]].astype(float), views.Ks[[1, 0]].astype(float)
        )
        height, width = SIZE
        inside = valid & (z > 0) & (u >= 0) & (v >= 0) & (u < width) & (v < height)
        seen = views.depths[0][v[inside].astype(int), u[inside].astype(int)]
        error = np.abs(seen - z[inside]) / z[inside]
        shared = error < 0.05  # the rest is hidden in view 0
        assert shared.mean() > 0.25
        assert np.median(error[shared]) < 0.01
        assert views.overlap >= 0.25


def test_sample_shapes_and_frames(samples) -> None:
    for views in samples:
        assert views.images.shape == (2, *SIZE, 3) and views.images.dtype == np.uint8
        assert views.depths.shape == (2, *SIZE) and views.depths.dtype == np.float32
        assert views.instances.shape == (2, *SIZE) and views.instances.dtype == np.uint8
        np.testing.assert_allclose(views.viewmats[0], np.eye(4), atol=1e-6)
        turn = views.viewmats[1, :3, :3]
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-5)
        assert np.linalg.det(turn) > 0
        assert 0.05 < np.linalg.norm(views.viewmats[1, :3, 3]) < 1.05
        np.testing.assert_allclose(views.Ks[:, :2, 2], [[SIZE[1] / 2, SIZE[0] / 2]] * 2)
        assert views.images.std() > 10


def test_instances_have_names(samples) -> None:
    for views in samples:
        assert len(views.names) == len(views.groups)
        assert views.names[0] == () and views.groups[0] == ""
        assert set(np.unique(views.instances)) - {0} == set(range(1, len(views.names)))
        assert np.array_equal(views.instances == 0, views.depths == 0)
        for words, group in zip(views.names[1:], views.groups[1:], strict=True):
            assert group in words and len(set(words)) == len(words)
            assert all(word == word.lower() and word for word in words)


def test_pictures_are_not_blocked(samples) -> None:
    for views in samples:
        for depth, ids in zip(views.depths, views.instances, strict=True):
            assert np.median(depth[depth > 0]) >= 0.6
            assert np.bincount(ids.ravel()).max() <= 0.75 * ids.size


def test_same_seed_same_sample(pack: Pack, renderer: RoomRenderer, samples) -> None:
    again = staged_room(2, pack, renderer, size=SIZE, libraries=HELD_OUT_LIBRARIES).views
    for field in dataclasses.fields(again):
        before, after = getattr(samples[2], field.name), getattr(again, field.name)
        assert np.array_equal(before, after) if isinstance(before, np.ndarray) else before == after
    assert not np.array_equal(samples[2].images, samples[3].images)


def test_more_views_and_oblong_pictures(pack: Pack, renderer: RoomRenderer) -> None:
    views = staged_room(11, pack, renderer, num_views=3, size=(84, 126), libraries=HELD_OUT_LIBRARIES).views
    assert views.images.shape == (3, 84, 126, 3)
    single = staged_room(11, pack, renderer, num_views=1, size=(84, 84), libraries=HELD_OUT_LIBRARIES).views
    assert single.overlap == 1.0 and single.images.shape == (1, 84, 84, 3)


def test_bad_arguments_are_named(pack: Pack, renderer: RoomRenderer) -> None:
    with pytest.raises(ValueError, match="num_views"):
        staged_room(0, pack, renderer, num_views=0)


def test_renderer_releases_twice(pack: Pack, renderer: RoomRenderer) -> None:
    with RoomRenderer(pack, renderer.ctx) as second:
        assert second.ctx is renderer.ctx
    second.release()
    assert renderer.ctx.error == "GL_NO_ERROR"
