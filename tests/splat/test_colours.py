"""Colours solved for: back from a scene's own pictures, never worse, and from nothing nothing.

With D the sums of contributions, rows of the matrix C of 1, Landweber's step is 1 / L of the metric D, so
after k rounds (Beck and Teboulle 2009, theorem 4.4; the box is separable, so clipping is its projection in D)

    |C f_k - photo|^2 <= |C f - photo|^2 + 4 |f_0 - f|_D^2 / (k + 1)^2   for any colours f in [0, 1]

and sum of D is the number of pixels: from grey, whose square distance is at most 1/4 a channel, a picture's
mean square error is at most that of the true colours plus 1 / (k + 1)^2.
"""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.splat import colours as module
from langflash_core.splat.colours import ROUNDS, solved_colours
from langflash_core.splat.mixing import mixing
from langflash_core.splat.projection import project
from langflash_core.splat.reference import rasterize
from langflash_core.types import Camera, Gaussians
from tests.splat.scenes import camera, cloud, parallel, splats, turned
from tests.torch_threads import torch_threads

CLOSE = 1e-5  # sums of some tens of float32 numbers in [0, 1]
SIDE = turned(0.2, (-0.3, 0.02, 0.1))


def scene(count: int = 400, size: float = 0.05, seed: int = 0) -> tuple[Gaussians, Tensor]:
    """Gaussians as opaque as elements are, and colours that have nothing to do with each other."""
    gaussians = cloud(count, size=size, seed=seed, dtype=torch.float32).gaussians
    opaque = dataclasses.replace(gaussians, opacities=torch.full((count,), 0.95))
    return opaque, torch.rand(count, 3, generator=torch.Generator().manual_seed(seed + 1))


def picture(gaussians: Gaussians, colours: Tensor, seen: Camera) -> tuple[Tensor, Tensor]:
    """(3, h, w) and alphas (h, w), by the reference in float64; what shines through has no part in it."""
    maps, alphas = rasterize(gaussians.map(lambda v: v.double()), colours.double(), seen)
    return (maps / alphas.clamp_min(1e-9)[..., None]).movedim(-1, 0).float(), alphas


def grey(colours: Tensor) -> Tensor:
    return torch.full_like(colours, 0.5)


def mean_square(psnr: float) -> float:
    return 10 ** (-psnr / 10)


def views(count: int, flat: bool = False) -> Sequence[Camera]:
    seen = (camera(), camera(pose=SIDE))[:count]
    return [parallel(one) if flat else one for one in seen]


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(("num_views", "flat"), [(1, False), (2, False), (2, True)])
def test_rounds_come_as_near_as_is_proven(num_views, flat, seed):
    """One's own pictures, by the reference, from grey; measured against what true colours leave, the pairs
    that `mixing` leaves out. And no round makes it worse."""
    gaussians, colours = scene(seed=seed)
    cameras = views(num_views, flat)
    photos = [picture(gaussians, colours, seen)[0] for seen in cameras]
    true = solved_colours(gaussians, colours, cameras, photos, rounds=0)
    left = np.mean([mean_square(before) for before, _ in true.psnr])
    assert left < 1e-3, "2 % of the light at most"
    errors = []
    for rounds in (0, 1, 2, 4, 8, 16):
        solved = solved_colours(gaussians, grey(colours), cameras, photos, rounds=rounds)
        errors.append(np.mean([mean_square(after) for _, after in solved.psnr]))
        # Views differ in how many pixels they show, 2 at most here, hence the factor.
        assert errors[-1] <= 2 * (left + 1 / (rounds + 1) ** 2)
        assert solved.colours.min() >= 0 and solved.colours.max() <= 1
    assert (np.diff(errors) <= 0).all()
    assert errors[4] < 0.1 * errors[0]


def _linear(count: int = 60) -> tuple[Gaussians, np.ndarray, Camera]:
    """A scene, and its matrix in float64, rows of 1 where at least half of a pixel's light is drawn."""
    gaussians, seen = scene(count, size=0.15)[0], camera(24, 20, 20.0)
    matrix = mixing(project(gaussians, seen), seen, count).toarray().astype(np.float64)
    light = matrix.sum(1)
    return gaussians, np.where(light >= 0.5, 1 / np.maximum(light, 0.5), 0)[:, None] * matrix, seen


@pytest.mark.parametrize("trusted", [False, True])
def test_equals_dense_float64_rounds(trusted):
    """The twin: the same rounds with dense matrices, two views at one place of which one is trusted less."""
    gaussians, matrix, seen = _linear()
    g = torch.Generator().manual_seed(2)
    photos = [torch.rand(3, 20, 24, generator=g) for _ in range(2)]
    trusts = [torch.rand(60, generator=g) for _ in range(2)] if trusted else None
    start = torch.rand(60, 3, generator=g)
    weights = [np.ones(60)] * 2 if trusts is None else [t.double().numpy() for t in trusts]
    shown = matrix.sum(1) > 0.5
    total = sum(w * matrix.sum(0) for w in weights)
    colours = ahead = start.double().numpy()
    pace = 1.0
    for _ in range(ROUNDS):
        step = np.zeros((60, 3))
        for photo, weight in zip(photos, weights, strict=True):
            wrong = (photo.double().flatten(1).T.numpy() - matrix @ ahead) * shown[:, None]
            step += weight[:, None] * (matrix.T @ wrong)
        found = np.clip(ahead + np.where(total > 0.05, 1 / np.maximum(total, 0.05), 0)[:, None] * step, 0, 1)
        following = (1 + math.sqrt(1 + 4 * pace**2)) / 2
        ahead, colours, pace = found + (pace - 1) / following * (found - colours), found, following
    solved = solved_colours(gaussians, start, [seen, seen], photos, trusts)
    assert np.abs(solved.colours.numpy() - colours).max() < 10 * CLOSE  # eight rounds, each a little ahead


def test_things_that_do_not_mix_are_solved_at_once():
    """One Gaussian a pixel: the mean over its pixels is its colour, after a single round."""
    places = [(x / 4, y / 4, 1.0) for x in (-2, -1, 0, 1, 2) for y in (-1, 0, 1)]
    gaussians = splats(places, 0.03, 0.99, dtype=torch.float32)
    colours = torch.rand(15, 3, generator=torch.Generator().manual_seed(0))
    solved = solved_colours(
        gaussians, grey(colours), [camera()], [picture(gaussians, colours, camera())[0]], rounds=1
    )
    assert (solved.colours - colours).abs().max() < CLOSE


def test_colours_stay_between_black_and_white():
    """A hard edge under wide Gaussians asks for more than white and less than black."""
    gaussians, colours = scene(size=0.1)
    photo = torch.zeros(3, 40, 48)
    photo[:, :, 24:] = 1
    solved = solved_colours(gaussians, grey(colours), [camera()], [photo], rounds=50)
    assert solved.colours.min() == 0 and solved.colours.max() == 1
    assert solved.colours.isfinite().all() and solved.colours.dtype == torch.float32


def test_who_is_not_seen_keeps_its_colour():
    """Behind the camera, beside it, no number, hidden by what is opaque, and too faint."""
    means = [(0, 0, 1.0), (0, 0, -1.0), (9, 0, 1.0), (math.nan, 0, 1.0), (0, 0, 9.0), (0.1, 0, 0.5)]
    gaussians = splats(means, [1.0, 1.0, 0.1, 1.0, 0.05, 0.1], [1.0] * 5 + [0.001], dtype=torch.float32)
    start = torch.rand(6, 3, generator=torch.Generator().manual_seed(0))
    solved = solved_colours(gaussians, start, [camera()], [torch.ones(3, 40, 48)])
    assert torch.equal(solved.colours[1:], start[1:])
    assert (solved.colours[0] - 1).abs().max() < CLOSE


def test_a_colour_that_is_no_number_stays_with_its_gaussian():
    """Those whose stored colour is none are not drawn."""
    gaussians, colours = scene(50)
    sh = gaussians.sh.clone()
    sh[7], start = torch.nan, grey(colours)
    start[7] = torch.nan
    gaussians = dataclasses.replace(gaussians, sh=sh)
    solved = solved_colours(gaussians, start, [camera()], [torch.rand(3, 40, 48)])
    assert solved.colours[7].isnan().all() and solved.colours.isnan().sum() == 3
    assert all(math.isfinite(psnr) for psnr in solved.psnr[0])


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_pixels_that_are_no_numbers_say_nothing(value):
    """As if they were not covered: colours are those of the rest of the photo, all the same."""
    gaussians, colours = scene()
    photo = picture(gaussians, colours, camera())[0]
    broken = photo.clone()
    broken[1, 10:20, 10:30] = value
    broken[0, 0, 0] = value
    solved = solved_colours(gaussians, grey(colours), [camera()], [broken])
    assert solved.colours.isfinite().all() and math.isfinite(solved.psnr[0][1])
    assert solved.psnr[0][1] > solved.psnr[0][0] + 10
    of_nothing = solved_colours(gaussians, grey(colours), [camera()], [torch.full_like(photo, value)])
    assert torch.equal(of_nothing.colours, grey(colours)) and of_nothing.psnr == ((100.0, 100.0),)


def test_a_view_without_trust_changes_nothing():
    gaussians, colours = scene()
    cameras = views(2)
    photo, lie = picture(gaussians, colours, cameras[0])[0], torch.rand(3, 40, 48)
    alone = solved_colours(gaussians, grey(colours), cameras[:1], [photo])
    trusts = [torch.ones(400), torch.zeros(400)]
    both = solved_colours(gaussians, grey(colours), cameras, [photo, lie], trusts)
    assert torch.equal(both.colours, alone.colours) and both.psnr[0] == alone.psnr[0]


@pytest.mark.parametrize("trust", [0.0, 1.0, 3.0])
def test_trusts_weigh_views(trust):
    """One Gaussian, a black photo and a white one: the mean, weighed."""
    gaussians = splats([(0, 0, 1.0)], 0.2, 0.99, dtype=torch.float32)
    photos = [torch.zeros(3, 40, 48), torch.ones(3, 40, 48)]
    trusts = [torch.ones(1), torch.full((1,), trust)]
    solved = solved_colours(gaussians, torch.full((1, 3), 0.2), [camera()] * 2, photos, trusts)
    assert (solved.colours - trust / (1 + trust)).abs().max() < CLOSE


@pytest.mark.parametrize("factor", [0.1, 100.0])
def test_only_the_ratio_of_trusts_counts(factor):
    """Where Gaussians cover a pixel and more: less than a share of one counts as not seen."""
    gaussians, colours = scene(100, size=0.2)
    cameras, photos = views(2), [torch.rand(3, 40, 48), torch.rand(3, 40, 48)]
    trusts = [torch.full((100,), 1.0), torch.full((100,), 0.5)]
    plain = solved_colours(gaussians, grey(colours), cameras, photos, trusts)
    scaled = solved_colours(gaussians, grey(colours), cameras, photos, [factor * t for t in trusts])
    sums = [mixing(project(gaussians, seen), seen, 100).sum(0) for seen in cameras]
    clear = torch.from_numpy(np.asarray(sums[0] + 0.5 * sums[1]).ravel()) > 5
    assert clear.sum() > 20
    # Those of which little is seen move in one and stay in the other, and a pixel has a bit of them.
    assert (plain.colours - scaled.colours)[clear].abs().mean() < 0.02


def test_views_that_show_nothing():
    """One looks away: the other's answer. All do, or there are no Gaussians: the start, nothing wrong."""
    gaussians, colours = scene()
    away = camera(pose=turned(math.pi, (0, 0, 0)))
    photo, other = picture(gaussians, colours, camera())[0], torch.rand(3, 40, 48)
    alone = solved_colours(gaussians, grey(colours), [camera()], [photo])
    both = solved_colours(gaussians, grey(colours), [camera(), away], [photo, other])
    assert torch.equal(both.colours, alone.colours) and both.psnr == (*alone.psnr, (100.0, 100.0))
    none = solved_colours(gaussians, colours, [away], [other])
    assert torch.equal(none.colours, colours) and none.psnr == ((100.0, 100.0),)
    empty = solved_colours(Gaussians.none(), torch.zeros(0, 3), [camera()], [photo])
    assert empty.colours.shape == (0, 3) and empty.psnr == ((100.0, 100.0),)


def test_footprints_larger_than_the_picture():
    """One that fills it has the photo's mean."""
    gaussians = splats([(0, 0, 1.0)], 1e3, 0.99, dtype=torch.float32)
    photo = torch.rand(3, 40, 48, generator=torch.Generator().manual_seed(0))
    solved = solved_colours(gaussians, torch.zeros(1, 3), [camera()], [photo], rounds=1)
    assert (solved.colours[0] - photo.mean((1, 2))).abs().max() < CLOSE


def test_psnr_is_that_of_the_drawn_picture():
    """Against the reference's picture with the solved colours, over pixels that are half covered: pairs left
    out move a pixel by about the 2 % of its light, of the error here less than a tenth of a decibel."""
    gaussians, colours = scene()
    g = torch.Generator().manual_seed(3)
    cameras, photos = views(2), [torch.rand(3, 40, 48, generator=g) for _ in range(2)]
    solved = solved_colours(gaussians, colours, cameras, photos)
    for shown, drawn in enumerate((colours, solved.colours)):
        for seen, photo, psnr in zip(cameras, photos, solved.psnr, strict=True):
            found, _ = picture(gaussians, drawn, seen)
            light = mixing(project(gaussians, seen), seen, 400).sum(1).reshape(40, 48)
            off = (found - photo)[:, torch.from_numpy(np.asarray(light)) >= 0.5]
            assert psnr[shown] == pytest.approx(-10 * math.log10(off.square().mean()), abs=0.1)
    assert all(after > before for before, after in solved.psnr)


def test_no_rounds_is_the_start_and_what_is_given_stays():
    gaussians, colours = scene()
    start, photo = grey(colours), torch.rand(3, 40, 48)
    kept, given = start.clone(), photo.clone()
    solved = solved_colours(gaussians, start, [camera()], [photo], rounds=0)
    assert torch.equal(solved.colours, start) and solved.psnr[0][0] == solved.psnr[0][1]
    moved = solved_colours(gaussians, start, [camera()], [photo])
    assert torch.equal(start, kept) and torch.equal(photo, given) and not torch.equal(moved.colours, start)


def test_twice_is_the_same_to_the_last_bit():
    gaussians, colours = scene()
    photos = [torch.rand(3, 40, 48)] * 2
    one, two = (solved_colours(gaussians, colours, views(2), photos) for _ in range(2))
    assert torch.equal(one.colours, two.colours) and one.psnr == two.psnr


def test_several_threads_say_the_same():
    gaussians, colours = scene()
    photos = list(torch.rand(2, 3, 40, 48))
    found = []
    for count in (1, 3):
        with torch_threads(count):
            found.append(solved_colours(gaussians, colours, views(2), photos))
    assert torch.equal(found[0].colours, found[1].colours) and found[0].psnr == found[1].psnr


def test_photos_and_cameras_are_as_many():
    gaussians, colours = scene(3)
    with pytest.raises(ValueError, match="one for each of"):
        solved_colours(gaussians, colours, views(2), [torch.rand(3, 40, 48)])


def test_every_view_and_round_is_told_and_may_be_the_last():
    gaussians, colours = scene(50)
    cameras = views(2)
    photos = [picture(gaussians, colours, seen)[0] for seen in cameras]
    told: list[float] = []
    solved_colours(gaussians, grey(colours), cameras, photos, progress=told.append)
    assert len(told) == len(cameras) + ROUNDS and told == sorted(told)
    assert told[0] == 0 and told[-1] < 1

    def stop(done: float) -> None:
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solved_colours(gaussians, grey(colours), cameras, photos, progress=stop)


def row_of_views(count: int) -> tuple[list[Camera], Gaussians, Tensor, list[Tensor]]:
    """A scene, cameras side by side before it, and its pictures there."""
    gaussians, colours = scene()
    cameras = [camera(pose=turned(0.02 * k, (-0.05 * k, 0, 0))) for k in range(count)]
    return cameras, gaussians, colours, [picture(gaussians, colours, seen)[0] for seen in cameras]


def test_no_photos():
    gaussians, colours = scene(3)
    solved = solved_colours(gaussians, colours, [], [])
    assert torch.equal(solved.colours, colours) and solved.psnr == ()


def test_of_many_photos_each_speaks_in_turn_and_colours_come_back(monkeypatch):
    """In blocks of 8 pixels of 48 x 40: the sixth of a picture each, and all of it together."""
    cameras, gaussians, colours, photos = row_of_views(12)
    for name, value in (("_MANY", 3), ("_EVERY", 2), ("_BLOCK", 8)):
        monkeypatch.setattr(module, name, value)
    owners = torch.full((400,), -1)
    owners[:100] = 0
    listed = []
    whole = module.mixed
    monkeypatch.setattr(module, "mixed", lambda *a, **k: listed.append(k["wanted"]) or whole(*a, **k))
    solved = solved_colours(gaussians, grey(colours), cameras, photos, owners=owners)
    assert all(wanted.mean() < 0.4 for wanted in listed[1:])
    assert listed[0].sum() > listed[1].sum()  # the first also speaks for its own
    before, after = np.mean(solved.psnr, axis=0)
    assert after > before + 10
    everywhere = solved_colours(gaussians, grey(colours), cameras, photos)
    drawn = [picture(gaussians, of.colours, cameras[5])[0] for of in (solved, everywhere)]
    off = [float((photos[5] - own).square().mean()) for own in drawn]
    assert -10 * math.log10(off[0] / off[1]) > -3  # pictures that agree are known from a part


def test_of_more_photos_than_blocks_none_is_silent(monkeypatch):
    """Twelve photos of four blocks each, of which one would speak in the twelfth of its blocks."""
    cameras, gaussians, colours, photos = row_of_views(12)
    for name, value in (("_MANY", 3), ("_EVERY", 1), ("_BLOCK", 24)):
        monkeypatch.setattr(module, name, value)
    owners = torch.full((400,), -1)
    solved = solved_colours(gaussians, grey(colours), cameras, photos, owners=owners)
    assert all(before < 30 and before + 10 < after < 100 for before, after in solved.psnr)


def test_few_photos_speak_everywhere_whoever_made_what():
    cameras, gaussians, colours, photos = row_of_views(4)
    owners = torch.arange(400) % 4
    with_owners = solved_colours(gaussians, grey(colours), cameras, photos, owners=owners)
    assert torch.equal(with_owners.colours, solved_colours(gaussians, grey(colours), cameras, photos).colours)


@pytest.mark.parametrize("size", [0.01, 0.2])
def test_only_what_touches_blocks_where_a_photo_speaks_is_looked_at(monkeypatch, size):
    """What is left out contributes nothing there: the same contributions, row by row, as of all."""
    monkeypatch.setattr(module, "_BLOCK", 8)
    scene, seen = cloud(400, size=size, dtype=torch.float32), camera()
    rows, photo = torch.arange(400), torch.rand(3, seen.height, seen.width)
    spoken = module._Spoken(np.zeros(400, bool), 1, 4)
    some, loud = spoken.heard(scene.gaussians, seen)
    assert not some.all() and 0 < (loud > 0).mean() < 0.5
    found = module._View.of(scene.gaussians, rows, seen, photo, None, {}, spoken)
    monkeypatch.setattr(
        module, "_meets", lambda blocks, centres, reach: torch.ones(len(centres), dtype=torch.bool)
    )
    whole = module._View.of(scene.gaussians, rows, seen, photo, None, {}, spoken)
    assert np.array_equal(found.ids, whole.ids)
    difference = abs(found.contributions - whole.contributions)
    assert difference.nnz == 0 or difference.max() < 1e-5  # float32, in batches of another size
