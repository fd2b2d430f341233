"""Walks through rendered rooms: free of things, photos that overlap, and what a camera does to them."""

import numpy as np
import pytest

from langflash_core.lab.evaluation.walk_measures import centres_of
from langflash_core.lab.evaluation.walk_rooms import found_way
from langflash_core.lab.evaluation.walk_subjects import Camcorder, planned, room_walks
from langflash_core.lab.rooms import Pack, RoomRenderer, StagedRoom, staged_room
from langflash_core.lab.rooms.cameras import MIN_OVERLAP, overlap_fraction, stands_free
from langflash_core.lab.rooms.catalogue import HELD_OUT_LIBRARIES

SEED = 900_000_000
SIZE = (84, 84)


@pytest.fixture(scope="module")
def staged(pack: Pack, renderer: RoomRenderer) -> StagedRoom:
    return staged_room(SEED, pack, renderer, num_views=3, size=SIZE, libraries=HELD_OUT_LIBRARIES)


def test_a_way_is_free_smooth_and_shares_what_it_shows(renderer: RoomRenderer, staged: StagedRoom):
    renderer.set_room(staged.room)
    way = found_way(staged, renderer, SEED)
    assert way is not None
    views = np.stack([way(share) for share in np.linspace(0, 1, 200)])
    places = centres_of(views)
    assert all(stands_free(staged.room, place) for place in places)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    turns = np.einsum("vij,vij->v", views[1:, :3, :3], views[:-1, :3, :3])  # 1 + 2 cos
    assert steps.max() < 3 * steps.mean() and turns.min() > 1 + 2 * np.cos(np.radians(5))
    assert steps.sum() > 1.0
    photos = np.stack([way(0.0), way(1.0)])
    K = staged.views.Ks[0].astype(float)
    depths = np.stack([renderer.draw(view, K, SIZE).depth for view in photos])
    assert overlap_fraction(depths, photos, np.stack([K, K])) > MIN_OVERLAP - 0.03
    again = found_way(staged, renderer, SEED)
    assert again is not None and np.array_equal(again(0.3), way(0.3))


def test_a_cramped_room_has_no_way(renderer: RoomRenderer, staged: StagedRoom, monkeypatch):
    monkeypatch.setattr("langflash_core.lab.evaluation.walk_rooms.stands_free", lambda room, eye: False)
    assert found_way(staged, renderer, SEED) is None


def walk_of(pack: Pack, renderer: RoomRenderer, camcorder: Camcorder):
    (walk,) = room_walks(pack, renderer, planned((3,)), count=1, camcorder=camcorder)
    return walk


def test_exposure_changes_photos_and_never_what_is_kept(pack: Pack, renderer: RoomRenderer):
    plain = walk_of(pack, renderer, Camcorder(times=1))
    kept, photos = plain.kept(1).image, [plain.photo(n).image for n in (0, 2, 4)]
    changed = walk_of(pack, renderer, Camcorder(exposure=2.0, times=1))
    others = [changed.photo(n).image for n in (0, 2, 4)]
    stops = np.log2(
        [o.mean((0, 1)) / p.mean((0, 1)) for o, p in zip(others, photos, strict=True)]
    )  # (3, RGB)
    assert np.array_equal(changed.kept(1).image, kept)
    assert np.ptp(stops, axis=0).min() > 0.2 and 0.01 < np.ptp(stops, axis=1).max() < 0.5


def test_a_frame_knows_where_it_was_taken(pack: Pack, renderer: RoomRenderer):
    walk = walk_of(pack, renderer, Camcorder(times=2))
    photo = walk.photo(0)
    assert photo.pose is not None and photo.K is not None and photo.depths is not None
    assert np.allclose(np.linalg.inv(photo.pose.numpy()), walk.camera(0), atol=1e-9)
    assert photo.image.shape[:2] == photo.depths.shape and photo.metric
    assert float(photo.K[0, 2]) == pytest.approx(photo.image.shape[1] / 2)


def test_somebody_passes_before_some_photos_and_is_gone_from_what_is_kept(pack: Pack, renderer: RoomRenderer):
    plain = walk_of(pack, renderer, Camcorder(times=1))
    kept, photos = plain.kept(1), [plain.photo(n) for n in (0, 2, 4)]
    crowded = walk_of(pack, renderer, Camcorder(passers=1, times=1))
    changed = []
    for photo, number in zip(photos, (0, 2, 4), strict=True):
        there = crowded.photo(number)
        assert photo.depths is not None and there.depths is not None
        assert (there.depths <= photo.depths + 1e-4).all()  # nobody makes a room larger
        changed.append(float((there.depths < 0.95 * photo.depths).mean()))
    assert sum(share > 0.02 for share in changed) == 1 and sum(share == 0 for share in changed) == 2
    assert np.array_equal(crowded.kept(1).image, kept.image)


def test_a_screen_shows_another_picture_in_some_photos(pack: Pack, renderer: RoomRenderer):
    frames = (6, 8, 12)  # of which it is another in the last one
    pictures, kept = [], []
    for screens in (0, 2):
        plan, camcorder = planned((8,)), Camcorder(screens=screens, times=1)
        (walk,) = room_walks(pack, renderer, plan, count=1, camcorder=camcorder)
        pictures.append([walk.photo(frame) for frame in frames])
        kept.append(walk.kept(12).image.astype(int))
    shown = []
    for bare, photo in zip(*pictures, strict=True):
        assert bare.depths is not None and photo.depths is not None
        assert np.array_equal(bare.depths, photo.depths)
        shown.append(np.abs(bare.image.astype(int) - photo.image).max(-1) > 30)
    assert min(where.mean() for where in shown) > 0.005
    where = np.abs(kept[0] - kept[1]).max(-1) > 30
    both = where & shown[2]
    assert np.abs(kept[1] - pictures[1][2].image)[both].mean() > 20  # not what the others show
