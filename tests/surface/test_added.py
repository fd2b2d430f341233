"""Layers of another scene: where they come to, in whose light, and what the record says of their photos."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from langflash_core.geometry.harmonics import SH_C0
from langflash_core.scene.exposure import lit_camera
from langflash_core.splat import render
from langflash_core.surface.added import Shared, add_layers
from langflash_core.types import Record, Scene
from tests.boxroom import box_room

GAINS = np.array([[1.0, 1.0, 1.0], [1.2, 1.1, 0.9], [0.8, 0.9, 1.1]])
OFFSETS = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, -0.01], [0.01, -0.02, 0.0]])
OTHER_GAIN, OTHER_OFFSET = np.array([0.7, 0.8, 0.9]), np.array([0.05, 0.02, 0.0])
"""What the other scene's light is to the first's: c = gain c' + offset."""
SHARED = Shared((1, 0), (0, 1))
NAMES = ("left.jpg", "middle.jpg", "right.jpg")


def whole() -> Scene:
    """A room as three photos' layers, alike but for whose they are."""
    room = box_room()
    count = len(room.gaussians)
    viewmats = torch.eye(4).repeat(3, 1, 1)
    viewmats[:, 0, 3] = torch.tensor([0.0, -0.15, -0.3])
    room = replace(room, viewmats=viewmats, Ks=room.Ks[:1].repeat(3, 1, 1), photos=(b"a", b"b", b"c"))
    thrice = room.rows(torch.arange(count).repeat(3))
    record = Record(
        preset="mini",
        layered=True,
        photos=NAMES,
        light={"gains": GAINS.tolist(), "offsets": OFFSETS.tolist()},
        foreseen={"covered": [0.9, 0.8, 0.7], "alike": [0.6, None, 0.5], "nearest": [1, 0, 1]},
        detail={"photos_psnr_db": [40.0, 39.0, 38.0]},
    )
    return replace(thrice, view_ids=torch.arange(3).repeat_interleave(count), record=record)


def of_views(scene: Scene, views: list[int]) -> Scene:
    """Some photos of a scene, in this order, as a scene of its own."""
    assert scene.view_ids is not None
    rows = torch.cat([(scene.view_ids == view).nonzero()[:, 0] for view in views])
    record, chosen = scene.record, np.array(views)
    numbers = {view: place for place, view in enumerate(views)}
    foreseen = {name: [record.foreseen[name][v] for v in views] for name in ("covered", "alike")}
    foreseen["nearest"] = [numbers.get(record.foreseen["nearest"][v], 0) for v in views]
    ids = torch.tensor([numbers[int(view)] for view in scene.view_ids[rows].unique_consecutive()])
    some = replace(
        scene.rows(rows),
        view_ids=ids.repeat_interleave(len(rows) // len(views)),
        viewmats=scene.viewmats[chosen],
        Ks=scene.Ks[chosen],
        photos=tuple(scene.photos[v] for v in views),
        record=replace(record, light={}),
    )
    return some.with_record(
        photos=tuple(record.photos[v] for v in views),
        light={"gains": GAINS[chosen].tolist(), "offsets": OFFSETS[chosen].tolist()},
        foreseen=foreseen,
        detail={"photos_psnr_db": [record.detail["photos_psnr_db"][v] for v in views]},
    )


def in_another_light(scene: Scene) -> Scene:
    """The same photos with colours c' of c = gain c' + offset."""
    gain, offset = torch.from_numpy(OTHER_GAIN), torch.from_numpy(OTHER_OFFSET)
    colours = 0.5 + SH_C0 * scene.gaussians.sh.double()
    sh = ((colours - offset) / gain - 0.5) / SH_C0
    gains, offsets = (np.array(scene.record.light[name]) for name in ("gains", "offsets"))
    light = {
        "gains": (gains / OTHER_GAIN).tolist(),
        "offsets": ((offsets - OTHER_OFFSET) / OTHER_GAIN).tolist(),
    }
    return replace(scene, gaussians=replace(scene.gaussians, sh=sh.float())).with_record(light=light)


@pytest.fixture(scope="module")
def scenes() -> tuple[Scene, Scene, Scene]:
    """All three photos; the first two; the second, the first and the third in another light."""
    every = whole()
    return every, of_views(every, [0, 1]), in_another_light(of_views(every, [1, 0, 2]))


@pytest.fixture(scope="module")
def grown(scenes) -> Scene:
    _, first, other = scenes
    return add_layers(first, other, SHARED)


def test_what_the_scene_has_stays_bit_by_bit(scenes, grown):
    _, first, _ = scenes
    count = len(first.gaussians)
    for name in ("means", "quats", "scales", "opacities", "sh"):
        assert torch.equal(getattr(grown.gaussians, name)[:count], getattr(first.gaussians, name)), name
    assert torch.equal(grown.viewmats[:2], first.viewmats) and grown.photos == (b"a", b"b", b"c")
    atoms = first.semantics.num_atoms
    assert torch.equal(grown.semantics.dictionary[:atoms], first.semantics.dictionary)


def test_the_new_layer_lies_where_it_belongs(scenes, grown):
    every, _, _ = scenes
    count = 2 * len(every.gaussians) // 3
    for name in ("means", "quats", "scales", "opacities"):
        assert torch.equal(getattr(grown.gaussians, name)[count:], getattr(every.gaussians, name)[count:]), (
            name
        )
    assert torch.equal(grown.viewmats[2], every.viewmats[2]) and torch.equal(grown.Ks[2], every.Ks[2])
    assert bool((grown.view_ids[count:] == 2).all())


def test_the_new_photo_s_picture_is_in_its_light(scenes, grown):
    every, _, _ = scenes
    ours = render(grown, lit_camera(grown, grown.camera(2)))
    right = render(every, lit_camera(every, every.camera(2)))
    # There and back in float32, lights rounded to 1e-6: some roundings of colours up to 1.2.
    assert float((ours.rgb - right.rgb).abs().max()) < 1e-5
    assert grown.record.light["gains"][2] == pytest.approx(GAINS[2].tolist(), abs=1e-5)
    assert grown.record.light["offsets"][2] == pytest.approx(OFFSETS[2].tolist(), abs=1e-5)


def test_its_weights_mean_what_they_meant(scenes, grown):
    every, first, _ = scenes
    rows = slice(len(first.gaussians), None)
    features = [
        (s.semantics.weight_values[rows, :, None] * s.semantics.dictionary[s.semantics.weight_ids[rows]]).sum(
            1
        )
        for s in (grown, every)
    ]
    assert torch.allclose(*features, atol=1e-6)


def test_the_record_speaks_of_all_photos(grown):
    record = grown.record
    assert record.photos == NAMES and record.layered
    assert record.foreseen["covered"] == [0.9, 0.8, 0.7] and record.foreseen["alike"] == [0.6, None, 0.5]
    assert record.foreseen["nearest"] == [1, 0, 1]  # of the other scene's numbers the first's
    assert record.detail["photos_psnr_db"] == [40.0, 39.0, 38.0]
    assert "shares" not in record.left_out


def test_what_was_left_out_of_one_scene_alone_is_kept(scenes):
    _, first, other = scenes
    other = other.with_record(left_out={"shares": [0.0, 0.0, 0.25]}, warnings=("right.jpg is blurred",))
    grown = add_layers(first, other, SHARED)
    assert grown.record.left_out["shares"] == [0.0, 0.0, 0.25]
    assert grown.record.warnings == ("right.jpg is blurred",)


def test_two_languages_do_not_mix(scenes):
    from langflash_core.errors import InputError

    _, first, other = scenes
    spoken = replace(other, semantics=replace(other.semantics, space="clip"))
    with pytest.raises(InputError, match="speaks clip"):
        add_layers(first, spoken, SHARED)


def test_what_no_photo_made_stays_with_its_own_scene(scenes, grown):
    """Fillings and merged things have the view -1, which numbers no photo."""
    _, first, other = scenes
    assert other.view_ids is not None
    ids = torch.where(torch.arange(len(other.view_ids)) < 7, -1, other.view_ids)
    assert len(add_layers(first, replace(other, view_ids=ids), SHARED).gaussians) == len(grown.gaussians)


def test_views_of_another_size_are_our_own_mistake(scenes):
    _, first, other = scenes
    with pytest.raises(ValueError, match="expected views of"):
        add_layers(first, replace(other, view_size=(48, 36)), SHARED)
