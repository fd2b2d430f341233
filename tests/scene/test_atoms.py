"""What is said about atoms, on a room whose answers are known."""

import io
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.language.spaces import language_space
from langflash_core.scene import atoms
from langflash_core.scene.atoms import alike_order, atom_pictures, atom_places, atom_shares
from tests.app.window.scenes import CHAIR, PHRASES, room


@pytest.fixture(scope="module")
def scene():
    return room(language_space("minilm").encode(list(PHRASES)))


def test_a_thumbnail_shows_where_a_photo_carries_the_atom(scene) -> None:
    """The photo's pixels say where they are: red is the column, green the row."""
    width, height = scene.view_size
    places = np.stack(np.meshgrid(np.linspace(0, 255, width), np.linspace(0, 255, height)), -1)
    photo = Image.fromarray(np.concatenate((places, 0 * places[..., :1]), -1).astype(np.uint8))
    stream = io.BytesIO()
    photo.save(stream, "PNG")
    pictures = atom_pictures(replace(scene, photos=(stream.getvalue(),) * 2))
    shown = [picture for picture in pictures if picture is not None]
    assert [picture.shape for picture in shown] == 3 * [(96, 96, 3)]
    chair, wall, floor = (picture[..., :2].mean((0, 1)) for picture in shown)
    places = []
    for seen in (scene.camera(view) for view in range(2)):
        viewmat = seen.viewmat.numpy()
        places.append(seen.K.numpy() @ (viewmat[:3, :3] @ np.array(CHAIR) + viewmat[:3, 3]))
    columns = [255 * p[0] / p[2] / width for p in places]
    assert min(abs(chair[0] - column) for column in columns) < 45  # a window of the block's own width
    assert wall[1] < 127 < floor[1]  # above and below the horizon


def test_alike_rows_stand_side_by_side() -> None:
    vectors = np.array([[1, 0], [0, 1], [0.99, 0.14], [0.14, 0.99]])
    order = alike_order(vectors @ vectors.T)
    assert abs(order.index(0) - order.index(2)) == abs(order.index(1) - order.index(3)) == 1


def test_shares_are_of_the_surface_not_of_the_count(scene) -> None:
    """Every Gaussian of an atom cut in four of half the size: it covers what it covered."""
    fine = scene.semantics.weight_ids[:, 0] == 1
    rows = torch.cat((torch.nonzero(~fine)[:, 0], *[torch.nonzero(fine)[:, 0]] * 4))
    cut = scene.rows(rows)
    halved = torch.where(fine[rows][:, None], 0.5, 1.0) * cut.gaussians.scales
    cut = replace(cut, gaussians=replace(cut.gaussians, scales=halved))
    assert 0 < atom_shares(scene)[1] < 1
    np.testing.assert_allclose(atom_shares(cut), atom_shares(scene), rtol=1e-6)


def test_some_of_millions_tell_shares_and_places(scene, monkeypatch) -> None:
    shares, places = atom_shares(scene), atom_places(scene)
    monkeypatch.setattr(atoms, "_ENOUGH", len(scene.gaussians) // 2 - 1)
    areas, real = [], atoms.covered_areas
    monkeypatch.setattr(atoms, "covered_areas", lambda some: areas.append(len(some)) or real(some))
    np.testing.assert_allclose(atom_shares(scene), shares, atol=0.05)
    assert 0 < areas[0] < len(scene.gaussians) / 2
    for some, place in zip(atom_places(scene), places, strict=True):
        assert some is not None and place is not None and np.allclose(some, place, atol=0.2)
