"""Elements close the surfaces they lie on, with the right depth, normal and order."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch
from torch import Tensor

from langflash_core.geometry.cameras import intrinsics_from_fov, invert_rigid, rays, transform
from langflash_core.geometry.harmonics import sh_to_colour
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.splat.projection import DILATION, project
from langflash_core.splat.reference import rasterize
from langflash_core.surface.blocks import Squares, grow_tree
from langflash_core.surface.elements import (
    COARSE,
    FINE,
    Elements,
    drawn_in,
    ground,
    join_elements,
    of_squares,
    place_elements,
    under,
)
from langflash_core.surface.settings import COVERING, UPSAMPLING
from langflash_core.surface.upsampling import Upsampled, upsample_depths
from langflash_core.types import Camera, Gaussians

FLOAT32 = 2e-5  # relative: some hundred float32 roundings at most
WALL = (0.0, 0.0, 1.0)
SLANTED = [WALL, (0.6, 0.0, 0.8), (0.0, -0.9, 0.44), (-0.6, 0.5, 0.62)]
TURNED = torch.tensor(
    [[0.6, 0.0, 0.8, 0.3], [0.0, 1.0, 0.0, -2.0], [-0.8, 0.0, 0.6, 1.0], [0.0, 0.0, 0.0, 1.0]]
)


@dataclass(frozen=True)
class Sight:
    """A plane through (0, 0, 2) of the camera, that `grid` cells saw and a photo of `ratio` pixels a cell."""

    camera: Camera
    log_depths: Tensor
    photo: Tensor
    depth: Upsampled

    @staticmethod
    def of(
        normal=WALL, grid=(24, 32), ratio: float = 3, viewmat: Tensor | None = None, fov: float = 20
    ) -> "Sight":
        K = intrinsics_from_fov(fov, grid[1], grid[0])
        facing = torch.nn.functional.normalize(torch.tensor(normal), dim=0)
        log_depths = (2 * facing[2] / (rays(K, grid[1], grid[0]) @ facing)).log()
        size = (round(grid[0] * ratio), round(grid[1] * ratio))
        photo = torch.rand(3, *size, generator=torch.Generator().manual_seed(0))
        depth = upsample_depths(log_depths, torch.ones(3, *grid), photo)
        camera = Camera(torch.eye(4) if viewmat is None else viewmat, K, grid[1], grid[0])
        return Sight(camera, log_depths, photo, depth)

    @property
    def size(self) -> tuple[int, int]:
        return self.photo.shape[-2], self.photo.shape[-1]

    def gaussians(self, elements: Elements) -> Gaussians:
        return place_elements(elements, self.log_depths, self.depth.slopes, self.camera, self.size)

    def coarse(self, side: int) -> Elements:
        return of_squares(squares(side, self.size), self.photo, self.depth)

    def fine(self, side: int) -> Elements:
        """On their ground."""
        return join_elements([self.coarse(side), self.ground()])

    def ground(self) -> Elements:
        return ground(squares(4, self.size), self.photo, self.depth)


def squares(side: int, size: tuple[int, int]) -> Squares:
    """All of one photo."""
    top, left = torch.meshgrid(torch.arange(0, size[0], side), torch.arange(0, size[1], side), indexing="ij")
    return Squares(left.flatten(), top.flatten(), side)


def window(sight: Sight, zoom: int, left: int, top: int, pixels: int) -> Camera:
    """The sight's camera at `zoom` times the photo's size, of which some pixels of the photo are drawn."""
    whole = sight.camera.with_size(sight.size[1] * zoom, sight.size[0] * zoom)
    K = whole.K.clone()
    K[0, 2] -= left * zoom
    K[1, 2] -= top * zoom
    return Camera(whole.viewmat, K, pixels * zoom, pixels * zoom)


def alphas(gaussians: Gaussians, camera: Camera) -> Tensor:
    """In float64."""
    white = torch.ones(len(gaussians), 1, dtype=torch.float64)
    return rasterize(gaussians.map(lambda values: values.double()), white, camera)[1]


@pytest.mark.parametrize("side", [1, 2, 4, 8, 16])
@pytest.mark.parametrize("zoom", [1, 2, 4, 8])
def test_a_flat_wall_is_closed_and_does_not_ripple(side, zoom):
    """White elements over black: half a step of a picture is .5 / 255; a period and more in the middle, where
    elements reach 3.3 deviations."""
    sight = Sight.of(grid=(36, 36))
    made = sight.fine(side) if side < 4 else sight.coarse(side)
    drawn = alphas(sight.gaussians(made), window(sight, zoom, 48, 48, max(side, 4)))
    assert float(drawn.min()) >= 0.998
    assert float(drawn.max() - drawn.min()) < 0.5 / 255


@pytest.mark.parametrize("normal", SLANTED)
@pytest.mark.parametrize("side", [1, 2, 4, 16])
def test_slanted_walls_are_closed_too(normal, side):
    sight = Sight.of(normal, grid=(36, 36))
    made = sight.fine(side) if side < 4 else sight.coarse(side)
    assert float(alphas(sight.gaussians(made), window(sight, 2, 44, 44, 16)).min()) >= 0.99


@pytest.mark.parametrize("normal", SLANTED)
@pytest.mark.parametrize("ratio", [1, 3])
def test_fine_elements_lie_on_the_plane_and_face_along_it(normal, ratio):
    sight = Sight.of(normal, ratio=ratio, viewmat=invert_rigid(TURNED))
    for side in (1, 2):
        made = sight.gaussians(sight.coarse(side))
        assert len(made) == sight.size[0] * sight.size[1] // side**2
        facing = torch.nn.functional.normalize(torch.tensor(normal), dim=0)
        pos_c = transform(sight.camera.viewmat, made.means)
        assert float((pos_c @ facing - 2 * facing[2]).abs().max()) < 5 * FLOAT32  # up to 5 units away
        normals = sight.camera.viewmat[:3, :3] @ quats_to_matrices(made.quats)[..., 2:]
        # 1 - cos of the angle; float32 differences of neighbours lose three of seven digits.
        assert float((normals[..., 0] @ facing).abs().min()) > 1 - 1e-4
        assert torch.equal(made.opacities, torch.full((len(made),), COVERING.opacity))


@pytest.mark.parametrize("normal", SLANTED)
@pytest.mark.parametrize("size", [(72, 96), (69, 91), (71, 95)])
def test_depths_of_all_are_those_of_the_plane_but_for_what_lies_behind(normal, size):
    """Ground by .004 and 8 pixels of slope, up to .06 of log depth; other coarse ones by .35 of that. A mean
    of log depths over 4 x 4 pixels is off by their variance, up to 1.3 slopes^2, slopes being below .03."""
    sight = Sight.of(normal)
    facing = torch.nn.functional.normalize(torch.tensor(normal), dim=0)
    photo = torch.rand(3, *size)
    depth = upsample_depths(sight.log_depths, torch.ones(3, 24, 32), photo)
    fx, fy = sight.camera.K[0, 0] * size[1] / 32, sight.camera.K[1, 1] * size[0] / 24
    for made, share in [
        *((of_squares(squares(side, size), photo, depth), 0.35 * (side > 2)) for side in (1, 2, 4)),
        (ground(squares(4, size), photo, depth), 1.0),
    ]:
        assert len(made) and int(made.cells.max()) < 24 * 32 and float(made.x.max()) < size[1]
        drawn = place_elements(made, sight.log_depths, depth.slopes, sight.camera, size)
        ray = torch.stack(
            ((made.x - size[1] / 2) / fx, (made.y - size[0] / 2) / fy, torch.ones_like(made.x)), -1
        )
        behind = drawn.means[:, 2].log() - (2 * facing[2] / (ray @ facing)).log()
        slopes = depth.slopes.flatten()[made.cells] * 32 / size[1]
        stated = share * (0.004 + 8 * slopes).clamp(max=0.06)
        # Cells are a pixel off at most; what they have of slope differs by a share of the slope's own.
        assert torch.allclose(behind, stated, atol=float(1.3 * slopes.max() ** 2) + FLOAT32)
        assert float(behind.max()) < 0.0605 + 1.3 * 0.03**2


@pytest.mark.parametrize("normal", [*SLANTED, (0.8, 0.0, 0.35), (0.55, 0.7, 0.2)])
@pytest.mark.parametrize("side", [1, 2])
def test_the_ground_lies_behind_all_that_lie_on_it(normal, side):
    """In the own camera, by z, in which pictures are put together. s is the slope of log depth a pixel: 4 x 4
    pixels differ by 3 2^.5 s; beyond .04 they are two, and three quarters of that lie behind the nearer one's
    middle: 3.2 s, less than .06 up to .018. Others that lie within 5 pixels of its middle are behind it by no
    more than 5 2^.5 s = 7.1 s, where 8 s stay below .06."""
    sight = Sight.of(normal, fov=60)
    below, on = sight.ground(), sight.coarse(side)
    slopes = sight.depth.slopes.flatten()[below.cells] / 3
    z_on, z_below = sight.gaussians(on).means[:, 2], sight.gaussians(below).means[:, 2]
    x, y = on.x - below.x[:, None], on.y - below.y[:, None]
    inside = (on.x // 4 == below.x[:, None] // 4) & (on.y // 4 == below.y[:, None] // 4)
    around = (x.abs() < 5) & (y.abs() < 5)
    for near, gentle in ((inside, slopes < 0.016), (around, slopes < 0.007)):
        assert (z_below[:, None] > z_on)[near & gentle[:, None]].all()
    assert (slopes < 0.016).any()


@pytest.mark.parametrize("normal", SLANTED[:3])
@pytest.mark.parametrize("side", [2, 8])
def test_footprints_in_the_own_photo_are_round_and_of_the_side(normal, side):
    """Deviations of .5 and .85 sides. Thickness adds (.1 tan)^2 of a side^2, by 64 degrees
    and less; what a pinhole bends within an element, a hundredth."""
    sight = Sight.of(normal)
    made = sight.coarse(side)
    drawn = project(sight.gaussians(made), sight.camera.with_size(96, 72))
    l11, l21, l22 = drawn.roots.unbind(-1)
    middle = ((drawn.centres - torch.tensor([48.0, 36.0])).abs() < 20).all(-1)
    expected = (side * (0.5 if side < 4 else 0.85)) ** 2
    for variance in ((l11**2 - DILATION)[middle], (l21**2 + l22**2 - DILATION)[middle]):
        assert torch.allclose(variance, torch.full_like(variance, expected), rtol=0.06)
    assert float((l11 * l21)[middle].abs().max()) < 0.06 * expected


def test_colours_and_cells_are_those_of_the_squares():
    sight = Sight.of(grid=(6, 8))
    for side in (1, 2, 4, 16):
        made = sight.coarse(side)
        corners = squares(side, sight.size)
        for i, (left, top) in enumerate(zip(corners.left.tolist(), corners.top.tolist(), strict=True)):
            inside = sight.photo[:, top : top + side, left : left + side]
            if inside.shape[-2:] == (side, side):
                assert torch.allclose(made.colours[i], inside.mean((1, 2)), atol=FLOAT32)
            row, column = int(made.pixels[i]) // 24, int(made.pixels[i]) % 24
            assert top <= row < top + side and left <= column < left + side
            assert int(made.cells[i]) == row // 3 * 8 + column // 3
        assert made.levels.unique().tolist() == [FINE if side < 4 else COARSE]
        assert not made.hidden.any() and made.sides.unique().tolist() == [side]
    drawn = sight.gaussians(sight.coarse(2))
    shown = sh_to_colour(drawn.sh, torch.zeros(len(drawn), 3))
    assert torch.allclose(shown, sight.coarse(2).colours, atol=FLOAT32)


def two_surfaces(near: Tensor) -> tuple[Tensor, Upsampled]:
    """A photo (3, 4, 4) of one square, red where it is near and blue elsewhere, and its depths."""
    photo = torch.stack((near.float(), torch.zeros(4, 4), (~near).float()))
    logs = torch.where(near, 0.1, 1.0)
    return photo, Upsampled(logs, torch.arange(16).view(4, 4), torch.zeros(4, 4))


@pytest.mark.parametrize("size", [(64, 80), (59, 70)])
def test_the_tree_knows_which_squares_have_two_grounds(size):
    """Depths that jump within some squares; at sizes that end within one, too."""
    generator = torch.Generator().manual_seed(0)
    logs = torch.nn.functional.interpolate(torch.rand(1, 1, 9, 11, generator=generator) / 9, size=size)[0, 0]
    photo, cells = torch.rand(3, *size, generator=generator), torch.zeros(size, dtype=torch.long)
    tree = grow_tree(photo, logs, torch.full(size, torch.inf), torch.ones(size, dtype=torch.bool))
    every = squares(4, size)
    made = ground(every, photo, Upsampled(logs, cells, torch.zeros(size)))
    torn = int(tree.torn[every.top // 4, every.left // 4].sum())
    assert 0 < torn < len(every) and len(made) == len(every) + torn


def test_a_square_of_two_surfaces_has_a_ground_of_each():
    near = torch.tensor([[1, 1, 1, 0], [1, 1, 0, 0], [1, 1, 0, 0], [1, 0, 0, 0]]).bool()
    photo, depth = two_surfaces(near)
    made = ground(squares(4, (4, 4)), photo, depth)
    assert made.log_depths.tolist() == pytest.approx([0.1, 1.0])
    assert made.colours.tolist() == [[1, 0, 0], [0, 0, 1]]
    assert made.hidden.all() and made.levels.tolist() == [COARSE, COARSE]
    for i, part in enumerate((near, ~near)):
        rows, columns = part.numpy().nonzero()
        assert float(made.x[i]) == pytest.approx(columns.mean() + 0.5)
        assert float(made.y[i]) == pytest.approx(rows.mean() + 0.5)
        assert bool(part.flatten()[made.pixels[i]]) and bool(part.flatten()[made.cells[i]])
        # Where pixels are squares of side 1 their own variance of 1 / 12 comes on top.
        spread = np.cov(np.stack((columns, rows)), bias=True) + np.eye(2) / 12
        expected = np.linalg.cholesky(spread * 0.72**2 * 12)
        assert made.roots[i].tolist() == pytest.approx(
            [expected[0, 0], expected[1, 0], expected[1, 1]], rel=1e-5
        )


@pytest.mark.parametrize("gap", [0.9 * UPSAMPLING.jump, 1.1 * UPSAMPLING.jump])
def test_a_square_is_of_two_surfaces_from_a_jump_on(gap):
    depth = Upsampled(
        torch.tensor([0.0, 0, 0, gap]).expand(4, 4), torch.zeros(4, 4).long(), torch.zeros(1, 1)
    )
    made = ground(squares(4, (4, 4)), torch.rand(3, 4, 4), depth)
    assert len(made) == (2 if gap > UPSAMPLING.jump else 1)


def test_one_pixel_of_another_surface_has_a_ground_as_wide_as_itself():
    near = torch.zeros(4, 4, dtype=torch.bool)
    near[2, 1] = True
    photo, depth = two_surfaces(near)
    made = ground(squares(4, (4, 4)), photo, depth)
    assert (float(made.x[0]), float(made.y[0])) == (1.5, 2.5)
    assert made.roots[0].tolist() == pytest.approx([0.72, 0, 0.72])


def test_ground_at_the_photos_end_ends_there():
    """Three of a square's four columns are outside: the mean is of those inside."""
    photo = torch.rand(3, 8, 9)
    depth = Upsampled(torch.zeros(8, 9), torch.zeros(8, 9).long(), torch.zeros(1, 1))
    made = ground(squares(4, (8, 9)), photo, depth)
    assert made.x.tolist() == pytest.approx([2, 6, 8.5] * 2)
    assert torch.allclose(made.colours[2], photo[:, :4, 8].mean(1), atol=FLOAT32)


def test_no_square_no_element():
    sight = Sight.of(grid=(6, 8))
    none = Squares(torch.zeros(0, dtype=torch.long), torch.zeros(0, dtype=torch.long), 4)
    for made in (of_squares(none, sight.photo, sight.depth), ground(none, sight.photo, sight.depth)):
        assert len(made) == 0 and len(sight.gaussians(made)) == 0
    assert len(under(sight.log_depths, torch.rand(3, 6, 8), sight.size)) == 0


@pytest.mark.parametrize(("dim", "sign"), [(1, 1), (1, -1), (0, 1), (0, -1)])
def test_the_farther_surface_goes_on_under_the_nearer_one(dim, sign):
    """One element a cell before the jump, half of what it goes on by towards the nearer side, in the farther
    one's depth."""
    log_depths = torch.full((24, 24), 1.0)
    nearer = torch.arange(24) >= 14 if sign > 0 else torch.arange(24) < 10
    log_depths[:, nearer] = 0.0
    log_depths = log_depths if dim == 1 else log_depths.T.contiguous()
    image = torch.rand(3, 24, 24)
    made = under(log_depths, image, (72, 72))
    assert len(made) == 24 and made.hidden.all() and (made.levels == COARSE).all()
    assert torch.equal(made.log_depths, torch.ones(24))
    before = 13 if sign > 0 else 10
    across, along = (made.x, made.y) if dim == 1 else (made.y, made.x)
    assert across.tolist() == pytest.approx([3 * (before + 0.5 + sign * COVERING.under / 2)] * 24)
    assert sorted(along.tolist()) == pytest.approx([3 * (k + 0.5) for k in range(24)])
    row, column = made.cells // 24, made.cells % 24
    assert ((column if dim == 1 else row) == before).all()
    assert torch.equal(made.colours, image[:, row, column].T)
    assert torch.equal(made.pixels, (3 * row + 1) * 72 + 3 * column + 1)
    camera = Camera(torch.eye(4), intrinsics_from_fov(60, 24, 24), 24, 24)
    drawn = place_elements(made, log_depths, torch.zeros(24, 24), camera, (72, 72))
    assert torch.allclose(drawn.means[:, 2], torch.tensor(1.004).exp(), rtol=FLOAT32)


def test_under_a_corner_and_behind_a_gap():
    """At a corner one goes on along the diagonal; what is nearer on both sides, on neither; small steps
    none."""
    log_depths = torch.zeros(20, 20)
    log_depths[:10, :10] = 1.0
    made = under(log_depths, torch.rand(3, 20, 20), (20, 20))
    corner = int((made.cells == 9 * 20 + 9).nonzero())
    assert float(made.x[corner]) == pytest.approx(9.5 + COVERING.under / 2 / 2**0.5)
    assert float(made.y[corner]) == pytest.approx(9.5 + COVERING.under / 2 / 2**0.5)
    slit = torch.zeros(20, 20)
    slit[:, 7] = 1.0
    assert len(under(slit, torch.rand(3, 20, 20), (20, 20))) == 0
    assert (
        len(under(0.15 * (torch.arange(20) > 9).float().expand(20, 20), torch.rand(3, 20, 20), (20, 20))) == 0
    )


@pytest.mark.parametrize("kind", ["grazing", "noise", "point", "far"])
def test_numbers_stay_finite(kind):
    """A floor up to its horizon, depths of nobody's making, one cell, and depths of a thousand units."""
    generator = torch.Generator().manual_seed(0)
    grid = (1, 1) if kind == "point" else (24, 32)
    K = intrinsics_from_fov(60, grid[1], grid[0])
    down = rays(K, grid[1], grid[0])[..., 1].clamp_min(1e-3)
    log_depths = {
        "grazing": -down.log(),
        "noise": 3 * torch.randn(grid, generator=generator),
        "point": torch.zeros(grid),
        "far": torch.full(grid, 7.0) + 0.1 * torch.randn(grid, generator=generator),
    }[kind]
    size = (3 * grid[0], 3 * grid[1])
    photo, image = torch.rand(3, *size), torch.rand(3, *grid)
    depth = upsample_depths(log_depths, image, photo)
    parts = [of_squares(squares(side, size), photo, depth) for side in (1, 2, 4, 16)]
    made = join_elements([*parts, ground(squares(4, size), photo, depth), under(log_depths, image, size)])
    drawn = place_elements(made, log_depths, depth.slopes, Camera(torch.eye(4), K, grid[1], grid[0]), size)
    for values in vars(drawn).values():
        assert torch.isfinite(values).all()
    assert (drawn.scales > 0).all() and (drawn.means[:, 2] > 0).all()
    assert torch.allclose(drawn.quats.norm(dim=-1), torch.ones(len(drawn)), atol=FLOAT32)


def deviations(made: Elements) -> np.ndarray:
    """(n, 2) pixels along rows and columns, of the covariances."""
    l11, l21, l22 = made.roots.double().numpy().T
    lower = np.stack((np.stack((l11, 0 * l11), -1), np.stack((l21, l22), -1)), -2)
    return np.sqrt(np.diagonal(lower @ lower.swapaxes(1, 2), axis1=1, axis2=2))


@pytest.mark.parametrize("side", [1, 4, 16])
def test_drawn_in_two_deviations_stay_on_the_surface(side):
    """Those with room stay to the last bit; others keep their shape, and all but their size; ground too."""
    sight = Sight.of()
    made = sight.fine(side) if side == 1 else sight.coarse(side)
    generator = torch.Generator().manual_seed(0)
    lean = torch.rand(len(made), generator=generator) * made.roots[:, 0]
    made = replace(made, roots=torch.stack((made.roots[:, 0], lean, made.roots[:, 2]), -1))
    clear = 0.5 + 40 * torch.rand(sight.size, generator=generator) ** 2
    clear[:, 30:60] = torch.inf
    kept, found = made.roots.clone(), drawn_in(made, clear)
    room = clear.flatten()[made.pixels].numpy() / 2
    before, after = deviations(made).max(1), deviations(found).max(1)
    np.testing.assert_allclose(after, np.minimum(before, np.maximum(room, 0.6)), rtol=FLOAT32)
    fits = torch.from_numpy(before < np.maximum(room, 0.6) * (1 - FLOAT32))
    assert fits.any() and (side == 1 or not fits.all())
    assert torch.equal(found.roots[fits], made.roots[fits])
    shape = (after / before)[:, None]
    np.testing.assert_allclose(found.roots.numpy(), made.roots.numpy() * shape, rtol=FLOAT32)
    for name in vars(made).keys() - {"roots"}:
        assert getattr(found, name) is getattr(made, name)
    assert torch.equal(made.roots, kept)


def test_drawn_in_nothing_ends_and_nothing_is_there():
    sight = Sight.of()
    made, clear = sight.coarse(8), torch.full(sight.size, torch.inf)
    assert torch.equal(drawn_in(made, clear).roots, made.roots)
    assert len(drawn_in(made.rows(made.x < 0), clear)) == 0


def test_rows_and_joined():
    made = Sight.of(grid=(6, 8)).coarse(4)
    first = made.rows(made.x < 6)
    both = join_elements([first, made.rows(made.x >= 6)])
    assert len(first) == 5 and len(both) == len(made) == 30
    assert torch.equal(both.cells.sort().values, made.cells.sort().values)
