"""The rasteriser for processors against the float64 reference."""

import numpy as np
import pytest
import torch

from langflash_core.errors import Cancelled
from langflash_core.splat.projection import project
from langflash_core.splat.reference import rasterize
from langflash_core.splat.settings import TILES
from langflash_core.splat.tiles import rasterize_tiles
from langflash_core.types import Gaussians
from tests.splat.scenes import camera, cloud, turned

# float32 moves an alpha across 1/255 in a few pixels, and a needle's offset by some ulps of its place; where
# a pixel is full, the rest is left out.
MEAN_ERROR = 2e-6
LARGEST_ERROR = 2 / 255


def drawn(gaussians: Gaussians, features, seen, **options):
    return rasterize_tiles(project(gaussians.map(lambda v: v.double()), seen), features, seen, **options)


@pytest.mark.parametrize("size", [0.004, 0.03, 0.3])
def test_sums_are_those_of_the_reference(size: float) -> None:
    scene = cloud(1500, num_atoms=7, size=size)
    seen = camera(61, 43, 50.0, turned(0.15, (0.1, 0.0, 0.1)))  # no whole number of tiles
    colours, weights = torch.rand(1500, 4), scene.semantics.dense_weights()
    (first, second), alphas = drawn(scene.gaussians, [colours, weights], seen, threads=2)
    expected, covered = rasterize(scene.gaussians, torch.cat((colours.double(), weights), 1), seen)
    assert covered.mean() > 0.05, "the scene must cover something"
    for found, right in ((first, expected[..., :4]), (second, expected[..., 4:]), (alphas, covered)):
        error = (found.double() - right).abs()
        assert error.mean() <= MEAN_ERROR + TILES.stop and error.max() <= LARGEST_ERROR + TILES.stop


def test_each_map_has_the_type_of_its_features() -> None:
    scene = cloud(50)
    seen = camera(16, 9)
    maps, _ = drawn(scene.gaussians, [torch.ones(50, 2), torch.ones(50, 3).half()], seen)
    assert [m.dtype for m in maps] == [torch.float32, torch.float16]
    assert [tuple(m.shape) for m in maps] == [(9, 16, 2), (9, 16, 3)]


def test_what_lies_behind_a_wall_is_left_out_within_the_stated_error() -> None:
    """A hundred opaque layers in one pixel's place: the first few fill it."""
    count = 100
    means = torch.zeros(count, 3, dtype=torch.float64)
    means[:, 2] = torch.linspace(1, 2, count)
    quats = torch.tensor([[1.0, 0, 0, 0]], dtype=torch.float64).expand(count, 4)
    scales = torch.full((count, 3), 1.0, dtype=torch.float64)
    walls = Gaussians(
        means, quats, scales, torch.full((count,), 0.9).double(), torch.zeros(count, 1, 3).double()
    )
    seen, features = camera(8, 8), torch.rand(count, 1)
    (found,), _ = drawn(walls, [features], seen)
    expected, _ = rasterize(walls, features.double(), seen)
    assert (found.double() - expected).abs().max() <= TILES.stop + 1e-6


def test_nothing_and_nan_and_one_are_drawn() -> None:
    seen = camera(20, 12)
    nobody = cloud(5).gaussians.map(lambda v: v[:0])
    (maps,), alphas = drawn(nobody, [torch.zeros(0, 3)], seen)
    assert maps.shape == (12, 20, 3) and not maps.any() and not alphas.any()
    one = cloud(2, size=0.2).gaussians
    one.means[0] = float("nan")
    (maps,), alphas = drawn(one, [torch.ones(2, 1)], seen)
    assert maps.isfinite().all() and torch.allclose(maps[..., 0], alphas, atol=1e-6)


def test_it_stops_when_nobody_wants_it() -> None:
    scene = cloud(500)
    asked = iter(np.arange(3))
    with pytest.raises(Cancelled):
        drawn(
            scene.gaussians,
            [torch.ones(500, 1)],
            camera(400, 400, 400.0),
            stopping=lambda: next(asked, None) is None,
        )


def test_features_of_another_number_are_refused() -> None:
    scene = cloud(10)
    with pytest.raises(ValueError, match="as many rows"):
        drawn(scene.gaussians, [torch.ones(10, 1), torch.ones(9, 1)], camera())
