"""What was hidden is not in the file: not in its photos, not in its tensors, from no side."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import InputError, SceneFileError
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.mending.hiding import Hiding, hide, least_margins, preview
from langflash_core.mending.looks import draw_scene
from langflash_core.mending.photos import dilate_mask, reaches
from langflash_core.scene.file import load, save
from langflash_core.types import Camera, Record

HOWS = ("blur", "pixels", "remove")
BLOCKS = 2.5  # along the screen: each is longer than a period of its pattern


@pytest.fixture(scope="module")
def done(known, tmp_path_factory):
    """Every way to hide the screen: the scene out of its file, the report, and the file's bytes."""
    folder, made = tmp_path_factory.mktemp("hidden"), {}
    for how in HOWS:
        scene, report = hide(known.scene, known.members, draw_scene, Hiding(how, BLOCKS))
        save(scene, folder / how)
        made[how] = load(folder / how), report, (folder / how).read_bytes()
    return made


def pixels(photo: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(photo)).convert("RGB")) / 255


def screens(known) -> list[np.ndarray]:
    """(h, w) bool: where each photo shows the screen."""
    return [
        ((photo - wall).abs().amax(0) > 0.02).numpy()
        for photo, wall in zip(known.photos, known.without, strict=True)
    ]


def likeness(shown: np.ndarray, secret: np.ndarray) -> float:
    """Correlation of what varies along a column: the screen's pattern, or nothing of it."""
    ours, theirs = (np.diff(values, axis=0)[..., 0].ravel() for values in (shown, secret))
    both = np.std(ours) * np.std(theirs)
    return 0.0 if both < 1e-9 else float(np.mean((ours - ours.mean()) * (theirs - theirs.mean())) / both)


@pytest.mark.parametrize("how", HOWS)
def test_no_photo_shows_the_pattern(known, done, how):
    scene, report, _ = done[how]
    for view, screen in enumerate(screens(known)):
        rows, columns = np.nonzero(screen)
        part = np.s_[rows.min() + 1 : rows.max(), columns.min() + 1 : columns.max()]
        secret, before = known.photos[view].movedim(0, -1).numpy(), pixels(known.scene.photos[view])
        assert likeness(before[part], secret[part]) > 0.9  # the measure finds it where it is
        # A column of blocks varies at their few edges alone, and of r rows e are as like as sqrt(2 e / r) to
        # any wave that they happen to meet at its steepest.
        by_chance = math.sqrt(2 * math.ceil(BLOCKS) / np.ptp(rows)) if how == "pixels" else 0.25
        assert abs(likeness(pixels(scene.photos[view])[part], secret[part])) < by_chance
        assert screen.mean() < report.photos[view] < 2 * screen.mean() + 0.1


def test_what_was_removed_has_no_colour_left_at_its_rim(known, done):
    """The screen is darker than all of the wall, by .2 and more."""
    for view, photo in enumerate(done["remove"][0].photos):
        assert pixels(photo)[..., 0].min() > float(known.without[view][0].min()) - 0.1
    assert float(pixels(known.scene.photos[0])[..., 0].min()) < 0.1


@pytest.mark.parametrize("how", HOWS)
def test_pixels_elsewhere_stay(known, done, how):
    for view, screen in enumerate(screens(known)):
        after, before = pixels(done[how][0].photos[view]), pixels(known.scene.photos[view])
        far = ~np.array(Image.fromarray(screen).resize(screen.shape[::-1])).astype(bool)
        far &= np.abs(after - before).max(-1) < 0.1  # the margin is painted, too
        assert far.mean() > 0.5
        assert np.abs(after - before)[far].mean() < 0.02  # what JPEG takes


def told(values: torch.Tensor) -> set[bytes]:
    """Rows in half precision, but that of no turn; -0 is 0."""
    rows = (values.half() + 0).flatten(1).numpy()
    none = np.array([1, 0, 0, 0], np.float16)
    return {row.tobytes() for row in rows if not np.array_equal(row, none)}


@pytest.mark.parametrize("how", HOWS)
def test_no_number_of_a_hidden_gaussian_is_in_the_file(known, done, how):
    scene, _, content = done[how]
    ours, hidden = scene.gaussians, known.scene.gaussians.rows(known.members)
    for name in ("means", "scales", "quats", "sh"):
        old, found = told(getattr(hidden, name)), told(getattr(ours, name))
        kept = known.scene.gaussians.rows(~known.members)
        secret = old - told(getattr(kept, name))
        assert name != "means" or len(secret) > 100
        assert not secret & found, name
    for mean in hidden.means[::7].numpy():
        assert mean.tobytes() not in content
    for photo in known.scene.photos:
        assert photo[len(photo) // 2 : len(photo) // 2 + 24] not in content


@pytest.mark.parametrize("how", HOWS)
def test_from_no_side_is_there_more_than_blocks(known, done, how, draw):
    """Where the screen was, nothing varies as it did."""
    scene, _, _ = done[how]
    hidden = known.scene.gaussians.rows(known.members)
    middle = hidden.means.double().mean(0)
    for x, y in ((0, 0), (1.2, 0), (-1.2, 0), (0, 1.0), (0.6, -0.8)):
        camera = looking(known.scene.camera(0), middle, torch.tensor([x, y, 0.0]))
        part = draw(known.scene.rows(known.members), camera, weight_maps=False)
        inside = (part.alphas > 0.95).numpy()
        if inside.sum() < 40:
            continue
        before = np.where(inside[..., None], draw(known.scene, camera, weight_maps=False).rgb.numpy(), 0)
        after = np.where(inside[..., None], draw(scene, camera, weight_maps=False).rgb.numpy(), 0)
        assert fine(before, inside, before) > 0.99
        assert abs(fine(after, inside, before)) < 0.15, (x, y)
        if how == "remove":
            assert np.median(after[inside][:, 0]) > 0.4  # the wall's


def fine(shown: np.ndarray, inside: np.ndarray, secret: np.ndarray) -> float:
    """The share that is left of how the secret varies, from a pixel to the one below, inside."""
    both = inside[1:] & inside[:-1]
    ours, theirs = (np.diff(each, axis=0)[..., 0][both] for each in (shown, secret))
    return float((ours * (theirs - theirs.mean())).mean() / theirs.var())


def looking(camera: Camera, middle: torch.Tensor, aside: torch.Tensor) -> Camera:
    """From aside at a place, upright."""
    eye = invert_rigid(camera.viewmat.double())[:3, 3] + aside.double() * float(middle.norm()) * 0.4
    ahead = torch.nn.functional.normalize(middle - eye, dim=0)
    down = torch.tensor([0.0, 1, 0]).double()
    right = torch.nn.functional.normalize(torch.linalg.cross(down, ahead), dim=0)
    viewmat = torch.eye(4, dtype=torch.float64)
    viewmat[:3, :3] = torch.stack((right, torch.linalg.cross(ahead, right), ahead))
    viewmat[:3, 3] = -viewmat[:3, :3] @ eye
    return replace(camera, viewmat=viewmat.float())


@pytest.mark.parametrize("how", ["remove", "pixels"])
def test_what_was_hidden_is_hidden_in_every_layer(known, draw, how):
    scene = known.scene
    done, report = hide(scene, known.members, draw, Hiding(how))
    assert done.layered and done.view_ids is not None and report.made > 0
    assert int((done.view_ids < 0).sum()) == report.made  # in every layer
    for view in range(2):
        camera = scene.camera(view)
        before = draw(scene.layer(view), camera)
        after = draw(done.layer(view), camera)
        was = before.depths < 0.8 * before.depths.max()  # the screen's pixels
        assert 0.03 < float(was.float().mean()) < 0.5
        # what takes its place closes each layer by itself, but for a rim
        assert float((after.alphas[was] > 0.5).float().mean()) > 0.9
        if how == "remove":
            assert float((after.depths[was] > 0.8 * before.depths.max()).float().mean()) > 0.9


def test_names_and_what_nobody_knows_go_with_it(known, draw):
    scene = known.scene.with_record(others={"thumbnail": "secret"}, atom_names={0: "Anna"})
    members = known.members
    only = scene.semantics.weight_values.clone()
    only[~members] = torch.where(scene.semantics.weight_ids[~members] == 0, 0.0, only[~members])
    scene = replace(scene, semantics=replace(scene.semantics, weight_values=only))
    hidden, report = hide(scene, members, draw, Hiding("remove", filled=False))
    assert report.names == ("Anna",) and report.unknown == ("thumbnail",)
    assert not hidden.record.atom_names and not hidden.record.others
    assert hidden.semantics.num_atoms < scene.semantics.num_atoms


def test_who_was_left_out_of_the_scene_is_painted_over_too(known, draw):
    """A passer-by in one photo, of whom the scene has nothing, so that no phrase finds him."""
    photo = np.asarray(Image.open(io.BytesIO(known.scene.photos[0])).convert("RGB")).copy()
    height, width = photo.shape[:2]
    part = np.s_[height // 2 :, : width // 5]
    photo[part] = (20, 250, 20)
    stream = io.BytesIO()
    Image.fromarray(photo).save(stream, "PNG")
    scene = replace(known.scene, photos=(stream.getvalue(), known.scene.photos[1]))
    scene = scene.with_record(left_out={"shares": [0.1, 0.0]})
    hidden, report = hide(scene, known.members, draw, Hiding("blur"))
    green = pixels(hidden.photos[0])
    assert not ((green[..., 1] - green[..., 0]) > 0.4).any()
    assert report.photos[0] > report.photos[1] + 0.05


def test_notes_pinned_to_it_go_and_others_stay(known, draw):
    inside = known.scene.gaussians.means[known.members].mean(0).tolist()
    notes = [{"text": "Anna", "at": inside}, {"text": "wall", "at": [-0.5, 0.0, 1.0]}]
    scene = known.scene.with_record(tour={"notes": notes}, thing_names={"picture 1": "Bob"})
    hidden, report = hide(scene, known.members, draw, Hiding("blur"))
    assert [note["text"] for note in hidden.record.tour["notes"]] == ["wall"]
    assert report.names == ("Bob", "Anna") and not hidden.record.thing_names


def test_photos_can_be_left_out(known, draw):
    hidden, report = hide(known.scene, known.members, draw, Hiding("blur", photos=False))
    assert hidden.photos == () and hidden.record.photos == () and report.photos_left_out


def test_a_preview_is_what_changes(known, done, draw):
    rows = preview(known.scene, known.members, draw)
    report = done["blur"][1]
    assert int(rows.sum()) == report.members + report.rim
    assert bool(rows[known.members].all())


def test_the_least_margin_of_a_pixel_is_its_distance_from_the_mask():
    """Against all pairs of pixels, in float64."""
    chosen = np.random.default_rng(3)
    mask = chosen.random((30, 40)) > 0.995
    rows, columns = np.indices(mask.shape)
    far = np.min([np.hypot(rows - y, columns - x) for y, x in np.argwhere(mask)], axis=0)
    true = np.where(far <= 2, 0.0, far / 40)
    assert np.abs(reaches(mask) - true).max() < 1e-6  # float32
    for margin in (0.0, 0.06, 0.11):
        assert (dilate_mask(mask, margin) == (true <= margin)).all()
    assert (
        np.isinf(reaches(np.zeros((5, 6), bool))).all() and not dilate_mask(np.zeros((5, 6), bool), 1.0).any()
    )


def test_the_least_margins_are_those_of_every_preview(known, draw):
    least = least_margins(known.scene, known.members, draw)
    assert (least[known.members] == 0).all() and float(least[least.isfinite()].max()) > 0.02
    for margin in (0.0, 0.05):
        report = hide(known.scene, known.members, draw, Hiding("blur", BLOCKS, margin))[1]
        assert report.members + report.rim == int((least <= margin).sum())


def test_what_cannot_be_hidden_is_said(known, draw):
    with pytest.raises(InputError, match="nothing was chosen"):
        hide(known.scene, torch.zeros_like(known.members), draw)
    with pytest.raises(InputError, match="30 blocks do not hide it"):
        Hiding("pixels", blocks=30)
    with pytest.raises(InputError, match="margin"):
        Hiding(margin=-1)
    broken = replace(known.scene, photos=(b"no photo", b"none"), record=Record())
    with pytest.raises(SceneFileError, match="--photos none"):
        hide(broken, known.members, draw)
