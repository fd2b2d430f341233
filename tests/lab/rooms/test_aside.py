"""A room seen from where no photo was taken: the same room, from a place where a camera fits."""

import numpy as np
import pytest

from langflash_core.lab.evaluation.side_subjects import staged_case
from langflash_core.lab.rooms import Pack, RoomRenderer, StagedRoom, staged_room
from langflash_core.lab.rooms.cameras import stands_free

SIZE = (56, 56)


@pytest.fixture(scope="module")
def staged(pack: Pack, renderer: RoomRenderer) -> StagedRoom:
    libraries = tuple({item.library for item in pack.items})
    return staged_room(3, pack, renderer, num_views=3, size=SIZE, libraries=libraries)


def test_a_room_is_seen_from_aside_as_from_its_own_place(renderer: RoomRenderer, staged: StagedRoom):
    case = staged_case(staged, renderer)
    subject = case.truth(SIZE)
    _, depths = staged.look(renderer, subject.photos[0].view.viewmat, staged.views.Ks[0], SIZE)
    # The stored depth is that of the same camera; the poses are float32.
    assert np.abs(depths - staged.views.depths[0]).max() < 1e-3
    names = {look.name for look in subject.others}
    assert names and len({look.group for look in subject.others}) >= 2
    for look in subject.others:
        assert look.rgb.shape == (56, 56, 3) and (look.view.depths > 0).any()
    with pytest.raises(ValueError, match="expected that of the rooms"):
        case.truth((70, 70))


def test_cameras_stand_in_the_room(staged: StagedRoom):
    eye = -staged.home[:3, :3].T @ staged.home[:3, 3]
    assert stands_free(staged.room, eye)
    assert not stands_free(staged.room, eye + np.array([50.0, 0, 0]))  # beyond the walls
