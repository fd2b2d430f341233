"""Scenes made to break a splat renderer, each against the float64 reference or a formula on paper.

Where errors come from, and the words the limits below are built from:

STEP    what storing one blend in a target may cost, as a share of the value. float16 has 11 bits
        and llvmpipe cuts where graphics cards round: 2^-10; float32: 2^-22 with the products before.
ALPHA   alphas are float32 at either precision: places, the footprint and exp() each cost a few
        ulps of numbers up to some tens (deviations, pixels).
PACKED  half a step of the sixteen-bit shares that a query reads. Relevancy at temperature 10 goes 2.5
        times as far as a cosine, and the steps of some 64 atoms at a pixel add up like their root, 8.
CUT     a pixel whose alpha is 1/255 but for rounding may be drawn by one and not by the other. That
        takes an alpha within 1e-6 of the cut: one in some millions. Only rims are allowed it here.
"""

import dataclasses
import math

import moderngl
import numpy as np
import pytest
import torch

from app.gl import SplatRenderer, offscreen_context
from app.gl.canvas import Canvas
from app.gl.splats import SplatBuffers
from langflash_core.errors import GraphicsError
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.language.relevance import CompiledQuery
from langflash_core.language.settings import RELEVANCE
from langflash_core.splat import render, view_depths
from langflash_core.types import Camera, Frame, Gaussians, Scene, Semantics
from tests.app.gl.questions import draw, full_relevance, question
from tests.splat.scenes import camera, cloud, maps_of, scene_of, splats, turned

pytestmark = pytest.mark.usefixtures("queries")

STEP = {"float16": 2**-10, "float32": 2**-22}
ALPHA = 1e-5
PACKED = 2**-17
CUT = 1.001 / 255
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def within(what: str, error: torch.Tensor | float, limit: float) -> None:
    """One measured error and its limit."""
    assert float(error) <= limit, f"{what}: {float(error):.2e} is above {limit:.2e}"


def largest(left: torch.Tensor, right: torch.Tensor) -> torch.Tensor:
    return (left.double() - right.double()).abs().max() if left.numel() else torch.zeros(())


class Watched:
    """Makes splats for a renderer, as one would, and keeps the last, so that its order can be looked at."""

    made: SplatBuffers

    def __init__(self, gl: moderngl.Context):
        self._make = Canvas(gl).hardware.splats

    def __call__(self, *given) -> SplatBuffers:
        self.made = self._make(*given)
        return self.made


def agree(frame: Frame, expected: Frame, precision: str, alpha: float = ALPHA, steps: float = 1) -> None:
    """Every pixel of a frame: alphas, colours, depth.

    Args:
        alpha: limit on alphas, absolute.
        steps: blends whose rounding reaches the picture, each of a value up to the brightest pixel.
    """
    parts = [frame.rgb, frame.alphas, frame.depths, maps_of(frame)]
    assert all(torch.isfinite(part).all() for part in parts)
    brightest = max(1.0, float(expected.rgb.max()))
    within("alphas", largest(frame.alphas, expected.alphas), alpha)
    within("colours", largest(frame.rgb, expected.rgb), brightest * (2 * alpha + steps * STEP[precision]))
    solid = expected.alphas > 0.1
    if solid.any():
        relative = (frame.depths - expected.depths)[solid].abs() / expected.depths[solid]
        within("depths", relative.max(), 1e-5)  # a quotient of float32 sums, at either precision


def pixels(picture: moderngl.Texture) -> torch.Tensor:
    return torch.frombuffer(bytearray(picture.read()), dtype=torch.uint8)


def centred(size: int = 21) -> Camera:
    """The middle of the middle pixel is the principal point."""
    return camera(size, size, 20.0)


# --- one splat ----------------------------------------------------------------------------------


def test_the_peak_is_the_opacity(gl, precision):
    scene = scene_of(splats([(0.0, 0.0, 2.0)], 0.1, 0.6, [(0.5, 1.0, 0.25)], torch.float32))
    frame = draw(gl, precision, scene, centred())
    within("peak", abs(frame.alphas[10, 10] - 0.6), 1e-6)  # exp(0) is 1: float32(0.6) alone
    shade = 0.6 * torch.tensor([0.5, 1.0, 0.25])
    within("colour", largest(frame.rgb[10, 10], shade), STEP[precision] * 0.6 + 1e-6)


@pytest.mark.parametrize("scale", [0.0, 1e-9, 0.02, 0.1])
def test_a_footprint_is_0_3_square_pixels_broader(gl, precision, scale):
    frame = draw(
        gl, precision, scene_of(splats([(0.0, 0.0, 2.0)], scale, 0.9, dtype=torch.float32)), centred()
    )
    variance = (20 * scale / 2) ** 2 + 0.3
    for step in (1, 2):
        expected = 0.9 * math.exp(-0.5 * step**2 / variance)
        expected = expected if expected >= 1 / 255 else 0.0
        for pixel in ((10, 10 + step), (10, 10 - step), (10 + step, 10), (10 - step, 10)):
            within("alpha", abs(frame.alphas[pixel] - expected), 1e-6)  # float32 exp() of numbers below 7


def test_alpha_is_held_at_0_99(gl, precision):
    for opacity in (1.0, 7.0):
        scene = scene_of(splats([(0.0, 0.0, 2.0)], 0.1, [opacity], dtype=torch.float32))
        frame = draw(gl, precision, scene, centred())
        within("peak", abs(frame.alphas[10, 10] - 0.99), 1e-7)  # the float32 nearest to 0.99
        agree(frame, render(scene, centred()), precision)


def test_alpha_of_exactly_1_over_255_is_drawn(gl, precision):
    """The float32 nearest to 1/255 lies above it; the one before does not and is cut."""
    border = np.float32(1 / 255)
    cases = {
        np.nextafter(border, np.float32(0)): False,
        border: True,
        np.nextafter(border, np.float32(1)): True,
    }
    for opacity, visible in cases.items():
        scene = scene_of(splats([(0.0, 0.0, 2.0)], opacities=[float(opacity)], dtype=torch.float32))
        for frame in (draw(gl, precision, scene, centred()), render(scene, centred())):
            assert int((frame.alphas > 0).sum()) == int(visible)


def test_no_edge_of_a_quad_is_seen(show, precision):
    """Anisotropic, faint and solid, off the pixel grid: only the cut at 1/255 may differ, by rounding."""
    g = torch.Generator().manual_seed(5)
    renderer = show(None, precision)
    flipped = 0
    for opacity in (0.0041, 0.006, 0.02, 0.1, 0.5, 1.0, 3.0) * 5:
        scene = cloud(1, 0, size=0.15, seed=int(torch.randint(1 << 30, (), generator=g)), dtype=torch.float32)
        place = torch.cat((0.4 * (torch.rand(1, 2, generator=g) - 0.5), torch.full((1, 1), 1.0)), 1)
        gaussians = dataclasses.replace(
            scene.gaussians, opacities=torch.tensor([opacity]), means=place, scales=scene.gaussians.scales / 2
        )
        scene = scene_of(gaussians)
        renderer.set_scene(scene)
        renderer.draw(camera())
        difference = (renderer.frame().alphas - render(scene, camera()).alphas).abs()
        within("edge", difference.max(), CUT)
        flipped += int((difference > ALPHA).sum())
    assert flipped <= 3, "of 35 rims of some tens of pixels, rounding reaches hardly any"


# --- sizes, places, order -------------------------------------------------------------------------

TILTED = (0.9, 0.1, 0.2, 0.3)
EDGE_ON = (math.cos(math.pi / 4), 0.0, math.sin(math.pi / 4), 0.0)  # the flat axis z turned into x
SHAPES = {
    "sub-pixel": (splats([(0.01, 0.02, 3.0), (0.3, 0.2, 1.0)], [1e-7, 0.0]), None),
    "needle": (splats([(0.0, 0.0, 2.0)], [(2.0, 2e-6, 2e-6)]), TILTED),
    "needle of 1e4": (splats([(0.0, 0.0, 2.0)], [(1e4, 1e-2, 1e-2)]), TILTED),
    "needle towards the eye": (splats([(0.1, 0.1, 2.0)], [(2e-6, 2e-6, 2.0)]), None),
    "disc, determinant near 0": (splats([(0.1, 0.0, 2.0)], [(0.5, 0.5, 1e-9)]), TILTED),
    "disc of no thickness, edge on": (splats([(0.0, 0.0, 2.0)], [(0.5, 0.5, 0.0)]), EDGE_ON),
    "huge, from inside": (splats([(0.5, 0.2, 0.5)], 50.0), None),
    "wider than float32": (splats([(0.5, 0.2, 0.5)], 1e30), None),
    "beyond 1.3 tan": (splats([(2.5, 0.3, 1.0), (-0.2, -1.6, 0.8)], [1.0, 0.7]), None),
    "far beyond 1.3 tan": (splats([(30.0, -20.0, 0.02)], 30.0), None),
    "places beyond float32": (splats([(1e38, -1e38, 0.02), (0.0, 0.0, 2.0)], 0.1), None),
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
def test_any_shape_anywhere(gl, precision, name):
    gaussians, quat = SHAPES[name]
    gaussians = gaussians.map(lambda v: v.float())
    if quat is not None:
        gaussians = dataclasses.replace(gaussians, quats=torch.tensor([quat] * len(gaussians)))
    expected = render(scene_of(gaussians), camera())
    assert expected.alphas.max() > 0.1, "something must be there"
    agree(draw(gl, precision, scene_of(gaussians), camera()), expected, precision)


@pytest.mark.parametrize("away", [10.0, 100.0, 1000.0])
def test_needles_from_far_outside(gl, precision, away):
    """Their centre is `20 away` pixels off and float32 rounds it to 2^-24 of that, twice (x and y).

    A needle's flank falls by 0.9 a pixel at most (opacity 0.8, deviation sqrt(0.3) px).
    """
    angle = math.atan2(0.3, 1.0)
    gaussians = splats([(away, 0.3 * away + 0.05, 2.0)], [(away, 1e-6 * away, 1e-6)], dtype=torch.float32)
    quat = torch.tensor([[math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)]])
    scene = scene_of(dataclasses.replace(gaussians, quats=quat))
    limit = ALPHA + 0.9 * 2 * (20 * away) * 2**-24 * 2
    agree(draw(gl, precision, scene, camera()), render(scene, camera()), precision, alpha=limit)


def test_nothing_nearer_than_near(show, precision):
    """Behind, at the camera's centre, just before 0.01: not drawn. The float32 next to it: drawn."""
    border = np.float32(0.01)  # below 0.01 by rounding
    hidden = [-1.0, -1e-30, 0.0, 1e-38, 1e-3, float(border)]
    renderer = show(None, precision)
    for depth in hidden:
        scene = scene_of(splats([(0.0, 0.0, depth)], 1e-4, dtype=torch.float32))
        renderer.set_scene(scene)
        renderer.draw(centred())
        assert renderer.frame().alphas.max() == 0 and render(scene, centred()).alphas.max() == 0
    scene = scene_of(
        splats([(0.0, 0.0, float(np.nextafter(border, np.float32(1))))], 1e-4, dtype=torch.float32)
    )
    renderer.set_scene(scene)
    renderer.draw(centred())
    agree(renderer.frame(weight_maps=True), render(scene, centred()), precision)
    assert renderer.frame().alphas.max() > 0.5


@pytest.mark.parametrize("away", [100.0, 1e4, 1e5])
def test_a_scene_far_from_its_origin(gl, precision, away):
    """float32 means are coarse there, 4e-3 at 1e5; what they say is drawn as exactly as anywhere."""
    scene = cloud(300, 0, size=0.05, dtype=torch.float32)
    shift = torch.tensor([away, -away / 2, away / 3])
    gaussians = dataclasses.replace(scene.gaussians, means=scene.gaussians.means + shift)
    pose = turned(0.3, (0.0, 0.0, 0.0))
    pose[:3, 3] = -pose[:3, :3] @ (shift.double() + torch.tensor([-0.6, 0.0, 0.1]))
    scene, seen = scene_of(gaussians), camera(pose=pose)
    expected = render(scene, seen)
    assert expected.alphas.max() > 0.9
    agree(draw(gl, precision, scene, seen), expected, precision, steps=4)  # a few layers a pixel


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_depths_from_1e_3_to_1e6(gl, precision, yaw):
    """All over one another, half transparent, in no order. 1e-3 is nearer than near: not drawn."""
    depths = [1e6, 0.02, 3.0, 1e-3, 1e4, 0.011, 30.0, 0.3, 1e5]
    pose = turned(yaw, (0.0, 0.0, 0.0))
    world = torch.tensor([[0.01 * z, 0.0, z] for z in depths], dtype=torch.float64) @ pose[:3, :3]
    g = torch.Generator().manual_seed(0)
    colours = [tuple(row) for row in torch.rand(len(depths), 3, generator=g).tolist()]
    gaussians = splats(
        [tuple(row) for row in world.tolist()], [0.1 * z for z in depths], 0.5, colours, torch.float32
    )
    scene, seen = scene_of(gaussians), camera(pose=pose)
    frame, expected = draw(gl, precision, scene, seen), render(scene, seen)
    agree(frame, expected, precision, steps=2)  # errors of the layers weigh 1, 1/2, 1/4...
    assert abs(expected.alphas[20, 24] - (1 - 2**-8)) < 0.01
    hidden = scene_of(gaussians.map(lambda v: torch.cat((v[:3], v[4:]))))
    assert torch.equal(draw(gl, precision, hidden, seen).rgb, frame.rgb)


def test_far_floaters_ruin_no_order(gl, show, precision):
    """Up to 1e30 away: 16-bit or shared-range sort keys would put all else in one bin."""
    near = cloud(600, 0, dtype=torch.float32).gaussians
    floaters = splats([(0.01 * z, 0.0, z) for z in np.geomspace(1e3, 1e30, 9)], 1.0, dtype=torch.float32)
    sh = torch.cat((floaters.sh, torch.zeros(9, 3, 3)), 1)
    floaters = dataclasses.replace(floaters, sh=sh)
    both = Gaussians(
        *(torch.cat(pair) for pair in zip(vars(floaters).values(), vars(near).values(), strict=True))
    )
    orders = []
    for gaussians in (near, both):
        watched = Watched(gl)
        renderer = show(scene_of(gaussians), precision, splats=watched)
        renderer.draw(camera())
        orders.append(watched.made.order)
        if gaussians is both:
            # About ten layers a pixel, of which the front ones shrink the errors of those behind.
            agree(renderer.frame(True), render(scene_of(both), camera()), precision, steps=4)
            assert renderer.depth_range[1] < 10, "the depth picture keeps its contrast, too"
    np.testing.assert_array_equal(orders[1][orders[1] >= 9] - 9, orders[0])


def test_200_opaque_layers(gl, precision):
    gaussians = splats([(0.0, 0.0, 1 + 0.01 * i) for i in range(200)], 0.2, 1.0, dtype=torch.float32)
    frame, expected = (
        draw(gl, precision, scene_of(gaussians), centred()),
        render(scene_of(gaussians), centred()),
    )
    within("middle", abs(frame.alphas[10, 10] - 1), 1e-6)  # 1 - 0.01^200
    # Layers of alpha a forget an error after 1 / a layers. Towards the rim a falls, but so do steps: where
    # the sum is below 1/2, a quarter, an eighth, its last bit halves each time.
    agree(frame, expected, precision, steps=8)


def test_of_equal_depths_the_first_is_in_front(gl, precision):
    gaussians = splats([(0.0, 0.0, 2.0)] * 3, 0.05, 0.5, [RED, GREEN, BLUE], torch.float32)
    frame = draw(gl, precision, scene_of(gaussians), centred())
    within("shares", largest(frame.rgb[10, 10], torch.tensor([0.5, 0.25, 0.125])), STEP[precision])


def test_equal_depths_stay_equal_in_any_view(gl, show, precision):
    """37 triples under a turned camera: in the order of the reference, the first of three in front."""
    g = torch.Generator().manual_seed(2)
    places = torch.rand(37, 3, generator=g) - 0.5 + torch.tensor([0.0, 0.0, 2.0])
    means = [tuple(row) for row in places.repeat_interleave(3, 0).tolist()]
    gaussians = splats(means, 0.05, 0.9, [RED, GREEN, BLUE] * 37, torch.float32)
    watched = Watched(gl)
    renderer = show(scene_of(gaussians), precision, splats=watched)
    for yaw in (0.1, 0.2, 0.3):
        seen = camera(pose=turned(yaw, (0.1, 0.0, 0.2)))
        renderer.draw(seen)
        back_to_front = torch.from_numpy(watched.made.order.astype(np.int64))
        nearest_first = view_depths(gaussians.map(lambda v: v.double()), seen).argsort(stable=True)
        assert torch.equal(back_to_front.flip(0), nearest_first)
        assert (nearest_first.unflatten(0, (37, 3)) % 3 == torch.arange(3)).all()
        # Three layers a splat and a few splats a pixel.
        agree(renderer.frame(True), render(scene_of(gaussians), seen), precision, steps=6)


QUATS = [
    (0.0, 0.0, 0.0, 0.0), (1e-14, 0.0, 1e-14, 0.0), (0.2, 0.4, 0.0, 0.0), (2e-11, 4e-11, 0.0, 0.0),
    (2e20, 4e20, 0.0, 0.0), (-0.1, -0.2, 0.3, 0.0),
]  # fmt: skip


@pytest.mark.parametrize("quat", QUATS)
def test_quaternions_of_any_norm(gl, precision, quat):
    gaussians = splats([(0.1, 0.0, 2.0)], [(0.4, 0.05, 0.1)], dtype=torch.float32)
    scene = scene_of(dataclasses.replace(gaussians, quats=torch.tensor([quat])))
    frame = draw(gl, precision, scene, camera())
    agree(frame, render(scene, camera()), precision)
    negated = scene_of(dataclasses.replace(gaussians, quats=-torch.tensor([quat])))
    assert torch.equal(draw(gl, precision, negated, camera()).rgb, frame.rgb)


def test_negative_scales_are_their_size(gl, precision):
    """Only squares of them count; culling must know, too."""
    gaussians = splats([(2.6, 0.0, 2.0)], [(-3.0, 0.1, 0.1)], dtype=torch.float32)
    expected = render(scene_of(gaussians), camera())
    assert expected.alphas.max() > 0.1
    agree(draw(gl, precision, scene_of(gaussians), camera()), expected, precision)


# --- values -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("field", ["means", "quats", "scales", "opacities", "sh", "weight_values"])
def test_not_finite_is_dropped_and_counted(gl, show, precision, field):
    scene = cloud(60, dtype=torch.float32)
    kept = torch.ones(60, dtype=torch.bool)
    kept[::10] = False
    semantics = scene.semantics
    whole = dataclasses.replace(
        scene,
        gaussians=scene.gaussians.map(lambda v: v[kept]),
        semantics=dataclasses.replace(
            semantics, weight_ids=semantics.weight_ids[kept], weight_values=semantics.weight_values[kept]
        ),
    )
    expected = draw(gl, precision, whole, camera())
    for bad in (math.nan, math.inf, -math.inf):
        owner = semantics if field == "weight_values" else scene.gaussians
        broken = getattr(owner, field).clone()
        broken.view(60, -1)[::10, -1] = bad
        owner = dataclasses.replace(owner, **{field: broken})
        poisoned = dataclasses.replace(
            scene, **{"semantics" if field == "weight_values" else "gaussians": owner}
        )
        renderer = show(poisoned, precision)
        renderer.draw(camera())
        renderer.ask(question(poisoned))
        frame = renderer.frame(weight_maps=True)
        assert torch.equal(frame.rgb, expected.rgb) and torch.equal(maps_of(frame), maps_of(expected))
        assert torch.isfinite(renderer.relevance()).all()
        truth = render(poisoned, camera())
        agree(frame, truth, precision, steps=4)  # a few layers a pixel


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_atoms_that_are_not_finite_say_nothing(renderer, bad):
    scene = cloud(200, 6, dtype=torch.float32)
    results = []
    for value in (bad, 0.0):
        dictionary = scene.semantics.dictionary.clone()
        dictionary[[1, 4], 3] = value
        dictionary[[1, 4]] *= value if value == 0 else 1.0
        changed = dataclasses.replace(
            scene, semantics=dataclasses.replace(scene.semantics, dictionary=dictionary)
        )
        renderer.set_scene(changed)
        renderer.draw(camera())
        renderer.ask(question(changed))
        results.append((renderer.relevance(), pixels(renderer.picture().atoms())))
    assert torch.equal(results[0][0], results[1][0]) and results[0][0].max() > 0
    assert torch.equal(results[0][1], results[1][1])


def test_opacity_0_and_1(gl, precision):
    means = [(0.0, 0.0, 2.0), (0.3, 0.0, 2.0), (0.3, 0.1, 1.0)]
    scene = scene_of(splats(means, 0.1, [0.0, 1.0, -1.0], dtype=torch.float32))
    frame = draw(gl, precision, scene, camera())
    agree(frame, render(scene, camera()), precision)
    assert frame.alphas.max() > 0.9 and frame.alphas[20, 18] == 0


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_gaussians(show, precision, count):
    scene = cloud(count, 3, size=0.1, dtype=torch.float32)
    expected = render(scene, camera(), background=(0.1, 0.2, 0.3))
    renderer = show(scene, precision)
    renderer.draw(camera(), background=(0.1, 0.2, 0.3))
    compiled = question(scene)
    renderer.ask(compiled)
    frame = renderer.frame(weight_maps=True)
    agree(frame, expected, precision)
    within("maps", largest(maps_of(frame), maps_of(expected)), ALPHA + 2 * STEP[precision])
    truth = full_relevance(scene, compiled, maps_of(expected))
    # Ten (the temperature) times a quarter (the sigmoid's slope) times the angle 2 steps make.
    solid = expected.alphas > 0.1
    within(
        "relevance",
        largest(renderer.relevance()[:, solid], truth[:, solid]),
        2.5 * 4 * STEP[precision] + 1e-5,
    )
    empty = expected.alphas == 0
    assert empty.any()
    assert all(part[empty].abs().max() == 0 for part in (frame.alphas, frame.depths, maps_of(frame)))
    assert renderer.relevance()[:, empty].abs().max() == 0


@pytest.mark.parametrize("num_atoms", [0, 1, 23, 24, 25, 128, 256])
def test_any_number_of_atoms_and_weights(show, precision, num_atoms):
    seen = camera(20, 16, 18.0)
    renderer = show(None, precision)
    for kept in range(1, 9):
        scene = cloud(150, num_atoms, kept, seed=kept, size=0.06, dtype=torch.float32)
        expected = render(scene, seen)
        renderer.set_scene(scene)
        renderer.draw(seen)
        maps = maps_of(renderer.frame(weight_maps=True))
        assert maps.shape == (16, 20, num_atoms)
        if num_atoms:
            # A few layers a pixel count; their steps are shares of W, which is up to 1 and on average less.
            within("maps", largest(maps, maps_of(expected)), ALPHA + 4 * STEP[precision])
            mean_limit = 2 * STEP[precision] * float(maps_of(expected).mean()) + 1e-6
            within("maps, mean", (maps - maps_of(expected)).abs().mean(), mean_limit)
        compiled = question(scene, 3)
        renderer.ask(compiled)
        truth = full_relevance(scene, compiled, maps_of(expected))
        # 10 / 4 (temperature, slope of the sigmoid) times the error of a cosine. What all maps lose alike
        # cancels in it; single pixels, where atoms cancel, have |F| well below the sum of W.
        error = (renderer.relevance() - truth).abs()
        within("relevance, mean", error.mean(), STEP[precision] + PACKED / 2)
        within("relevance", error[:, expected.alphas > 0.1].max(), 10 * STEP[precision] + 20 * PACKED)


def test_colours_out_of_range(gl, precision):
    """Above 1 kept, below 0 cut at 0, beyond float16 held at its largest number, never infinite."""
    colours = [(1.8, -0.7, 0.5), (60000.0, -60000.0, 4.0)]
    for colour in colours:
        scene = scene_of(splats([(0.0, 0.0, 2.0)], colours=[colour], dtype=torch.float32))
        agree(draw(gl, precision, scene, camera()), render(scene, camera()), precision)
    absurd = splats([(0.0, 0.0, 2.0)] * 3, 0.2, 0.9, [(1e30, 1e5, -1e30)] * 3, torch.float32)
    frame = draw(gl, precision, scene_of(absurd), centred())
    assert torch.isfinite(frame.rgb).all()
    held = 65504 * frame.alphas[10, 10]
    within("held", largest(frame.rgb[10, 10, :2], held.expand(2)), 65504 * 3 * STEP[precision])
    mixed = torch.zeros(1, 9, 3)
    mixed[0, [1, 2, 6, 8]] = torch.tensor([[3e38], [-3e38], [3e38], [-3e38]])  # inf - inf in float32
    broken = dataclasses.replace(splats([(0.1, 0.1, 2.0)], dtype=torch.float32), sh=mixed)
    assert torch.isfinite(draw(gl, precision, scene_of(broken), camera()).rgb).all()


PINHOLES = {
    "off centre, not square": ((45.0, 30.0, 5.0, 60.0), (64, 48)),
    "principal point outside": ((60.0, 40.0, -20.0, 60.0), (64, 48)),
    "1 x 1": ((2.0, 2.0, 0.5, 0.5), (1, 1)),
    "4096 x 16": ((2000.0, 60.0, 2048.0, 8.0), (4096, 16)),
    "2 x 300": ((40.0, 40.0, 1.0, 150.0), (2, 300)),
}


@pytest.mark.parametrize("name", PINHOLES)
def test_any_pinhole_and_size(gl, precision, name):
    (fx, fy, cx, cy), size = PINHOLES[name]
    seen = Camera(torch.eye(4), torch.tensor([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]), *size)
    scene = cloud(200, dtype=torch.float32)
    expected = render(scene, seen)
    assert expected.alphas.max() > 0.3
    agree(draw(gl, precision, scene, seen), expected, precision, steps=4)


# What 10,000 layers leave of a float16 colour: a sum C stops growing towards c where what a layer adds,
# alpha (c - C), is below the last bit of C, 2^-11 for C in [1/2, 1): 2^-11 / alpha is missing, 12 % of
# white at alpha = 0.004, the thinnest layer drawn, and 1 % at 0.05 (llvmpipe cuts; rounding halves it).
# Alphas and depths are float32 and do not suffer; cosines hardly, as all maps lose about the same share.
@pytest.mark.parametrize("opacity", [0.004, 0.01, 0.05])
def test_10000_thin_layers(show, precision, opacity):
    count = 10_000
    depth = 1 + 1e-4 * torch.arange(count)[:, None]
    g = torch.Generator().manual_seed(0)
    gaussians = Gaussians(
        torch.cat((torch.zeros(count, 2), depth), 1),
        torch.tensor([[1.0, 0.0, 0.0, 0.0]]).repeat(count, 1),
        torch.full((count, 3), 50.0),
        torch.full((count,), opacity),
        ((torch.tensor([0.8, 0.4, 0.1]) - 0.5) / SH_C0).expand(count, 1, 3).contiguous(),
    )
    values = torch.tensor([[0.6, 0.3, 0.1]]).repeat(count, 1)
    atoms = torch.nn.functional.normalize(torch.randn(3, 8, generator=g), dim=-1)
    scene = scene_of(gaussians, torch.tensor([[0, 1, 2]]).repeat(count, 1), values, atoms)
    seen = camera(5, 4, 4.0)
    expected = render(scene, seen)
    renderer = show(scene, precision)
    renderer.draw(seen)
    compiled = question(scene, 3)
    renderer.ask(compiled)
    frame = renderer.frame(weight_maps=True)
    # The same in float32, whose last bit is 2^-24 there.
    within("alphas", largest(frame.alphas, expected.alphas), 2**-24 / opacity)
    within("colours", largest(frame.rgb, expected.rgb), 0.51 * STEP[precision] / opacity)
    within("maps", largest(maps_of(frame), maps_of(expected)), 0.51 * STEP[precision] / opacity)
    truth = full_relevance(scene, compiled, maps_of(expected))
    within("relevance", largest(renderer.relevance(), truth), {"float16": 5e-3, "float32": 1e-5}[precision])


# --- questions ----------------------------------------------------------------------------------------


def wall(values: list[float], atoms: torch.Tensor, opacity: float = 1.0) -> Scene:
    """One Gaussian over the whole view with these weights on these atoms (K, C)."""
    gaussians = splats([(0.0, 0.0, 1.0)], 100.0, opacity, dtype=torch.float32)
    return scene_of(gaussians, torch.arange(len(values))[None], torch.tensor([values]), atoms.float())


def phrases(scene: Scene, texts: torch.Tensor, negatives: torch.Tensor, temperature: float) -> CompiledQuery:
    """A query for unit rows in the scene's C channels, brought into its dictionary's span."""
    compiled = question(scene, 1)
    basis = torch.linalg.qr(scene.semantics.dictionary.double().T)[0].T  # as `reduce_dictionary`
    return dataclasses.replace(
        compiled,
        prompts=texts.double() @ basis.T,
        negatives=negatives.double() @ basis.T,
        temperature=temperature,
        mode="relevancy" if len(negatives) else "cosine",
        texts=tuple(str(row) for row in range(len(texts))),
    )


def asked(gl, precision, scene: Scene, compiled: CompiledQuery) -> tuple[torch.Tensor, torch.Tensor]:
    """Relevance (P, H, W) by the renderer and the long way round."""
    seen = camera(6, 5, 5.0)
    renderer = SplatRenderer(gl, precision)
    renderer.set_scene(scene)
    renderer.draw(seen)
    renderer.ask(compiled)
    relevance = renderer.relevance()
    renderer.release()
    assert torch.isfinite(relevance).all()
    return relevance, full_relevance(scene, compiled, maps_of(render(scene, seen)))


NONE = torch.zeros(0, 4)
AXES = torch.eye(4)


@pytest.mark.parametrize("length", [0.0, 0.9 * RELEVANCE.empty_norm, 1.1 * RELEVANCE.empty_norm, 1e-3])
def test_a_vector_shorter_than_epsilon_has_no_relevance(gl, precision, length):
    scene = wall([1.0], length / 0.99 * AXES[:1])
    texts = torch.tensor([[0.6, 0.8, 0.0, 0.0]])
    for negatives in (NONE, AXES[2:3]):
        relevance, truth = asked(gl, precision, scene, phrases(scene, texts, negatives, 10.0))
        assert (relevance == 0).all() == (length < RELEVANCE.empty_norm) == (truth == 0).all()
        within("relevance", largest(relevance, truth), 1e-6)  # W cancels out of a single atom's cosine


def test_opposite_atoms_cancel(gl, precision):
    """Equal halves of d and -d are equal in any precision: exactly 0, not a direction made of rounding."""
    scene = wall([0.5, 0.5], torch.stack((AXES[0], -AXES[0])))
    relevance, truth = asked(gl, precision, scene, phrases(scene, AXES[:2], NONE, 10.0))
    assert (relevance == 0).all() and (truth == 0).all()


@pytest.mark.parametrize("temperature", [10.0, 1e4, 1e6])
def test_softmax_of_huge_logits(gl, precision, temperature):
    """Cosines up to 1 make logits of up to +-1e6: 0, 1/2 and 1 come out, no overflow."""
    scene = wall([0.7, 0.3], AXES[:2])
    near = torch.tensor([0.5 / temperature, 1.0, 0.0, 0.0])  # its logit is 0.46 above the negative's
    texts = torch.stack((AXES[0], AXES[1], -AXES[0], AXES[2], torch.nn.functional.normalize(near, dim=0)))
    compiled = phrases(scene, texts, AXES[1:2], temperature)
    relevance, truth = asked(gl, precision, scene, compiled)
    # W is wrong by a step, a cosine of it by up to half of that, and by two roundings of float32 (of W D, and
    # of that with the text), a logit by the temperature times it; the sigmoid's slope is 1/4 at 0 and gone
    # where logits are a hundred apart.
    off = STEP[precision] / 2 + 2 * 2.0**-23
    within("near a tie", largest(relevance[4], truth[4]), min(1.0, temperature * off / 4))
    steep = 0.25 if temperature == 10.0 else 0.0
    within("relevance", largest(relevance[:4], truth[:4]), steep * temperature * STEP[precision] + 1e-6)
    assert (relevance[1] == 0.5).all(), "a phrase against itself is undecided"


def test_two_identical_atoms_are_one(gl, precision):
    texts = torch.nn.functional.normalize(torch.tensor([[1.0, 2.0, 0.0, 0.5], [0.0, -1.0, 1.0, 0.0]]), dim=-1)
    split, merged = wall([0.2, 0.5, 0.3], AXES[[0, 1, 0]]), wall([0.5, 0.5], AXES[:2])
    results = [asked(gl, precision, s, phrases(s, texts, AXES[2:], 10.0)) for s in (split, merged)]
    within("truths", largest(results[0][1], results[1][1]), 1e-7)  # float32 weights
    for relevance, truth in results:
        within("relevance", largest(relevance, truth), 2.5 * 2 * STEP[precision] + 1e-6)


def test_an_atom_of_no_length(gl, precision):
    scene = wall([0.4, 0.6], torch.stack((torch.zeros(4), AXES[1])))
    texts = torch.tensor([[0.6, 0.8, 0.0, 0.0]])
    relevance, truth = asked(gl, precision, scene, phrases(scene, texts, NONE, 10.0))
    within("relevance", largest(relevance, truth), 1e-6)  # one direction is left: W cancels
    assert relevance.min() > 0.79
    silent = wall([1.0], torch.zeros(1, 4))
    relevance, truth = asked(gl, precision, silent, phrases(silent, texts, AXES[2:], 10.0))
    assert (relevance == 0).all() and (truth == 0).all()


def test_a_prompt_at_right_angles_to_all_atoms(gl, precision):
    scene = wall([0.4, 0.6], AXES[:2])
    relevance, _ = asked(gl, precision, scene, phrases(scene, AXES[3:], NONE, 10.0))
    within("cosine", relevance.abs().max(), 1e-12)
    relevance, truth = asked(gl, precision, scene, phrases(scene, AXES[3:], AXES[2:3], 10.0))
    assert (relevance == 0.5).all() and (truth == 0.5).all(), "neither it nor the negative fits"


# --- in the middle of a frame ---------------------------------------------------------------------------


def everything(renderer: SplatRenderer) -> list[torch.Tensor]:
    frame = renderer.frame(weight_maps=True)
    heat = pixels(renderer.heat_texture())
    return [frame.rgb, frame.alphas, frame.depths, maps_of(frame), renderer.relevance(), heat]


def fresh(gl, precision, scene: Scene, seen: Camera) -> list[torch.Tensor]:
    renderer = SplatRenderer(gl, precision)
    renderer.set_scene(scene)
    renderer.ask(question(scene))
    renderer.draw(seen)
    made = everything(renderer)
    renderer.release()
    return made


def same(left: list[torch.Tensor], right: list[torch.Tensor]) -> bool:
    return all(torch.equal(a, b) for a, b in zip(left, right, strict=True))


def all_around(num_atoms: int = 30) -> Scene:
    """A cloud before and one behind the camera."""
    front, back = (cloud(150, num_atoms, seed=seed, size=0.06, dtype=torch.float32) for seed in (0, 1))
    behind = dataclasses.replace(back.gaussians, means=-back.gaussians.means)
    gaussians = [
        torch.cat(pair) for pair in zip(vars(front.gaussians).values(), vars(behind).values(), strict=True)
    ]
    semantics = Semantics(
        torch.cat((front.semantics.weight_ids, back.semantics.weight_ids)),
        torch.cat((front.semantics.weight_values, back.semantics.weight_values)),
        front.semantics.dictionary,
        "test",
    )
    return dataclasses.replace(front, gaussians=Gaussians(*gaussians), semantics=semantics)


@pytest.mark.parametrize("weight_maps", [True, False])
def test_half_a_turn_in_one_frame(gl, show, precision, weight_maps):
    """Draw, turn, draw: whatever was drawn before, a view equals a fresh one bit by bit."""
    scene = all_around()
    views = [camera(), camera(pose=turned(math.pi, (0.0, 0.0, 0.0)))]
    expected = [fresh(gl, precision, scene, seen) for seen in views]
    assert not same(*expected)
    renderer = show(scene, precision, asked=question(scene))
    for index in (0, 1, 0):
        renderer.draw(views[1 - index], weight_maps=weight_maps)
        renderer.draw(views[index], weight_maps=weight_maps)
        assert same(everything(renderer), expected[index])
    agree(renderer.frame(True), render(scene, views[0]), precision, steps=4)


def test_a_resize_between_the_passes_of_a_frame(gl, show, precision):
    scene = all_around()
    small, wide = camera(20, 16, 20.0), camera(50, 9, 30.0)
    expected = {seen.width: fresh(gl, precision, scene, seen) for seen in (small, wide)}
    renderer = show(scene, precision, asked=question(scene))
    for first, then in ((small, wide), (wide, small), (small, wide)):
        renderer.draw(first, weight_maps=False)
        renderer.draw(then, weight_maps=False)
        renderer.relevance()
        renderer.draw(first)
        renderer.heat_texture()
        with pytest.raises(GraphicsError):  # a size refused leaves the view as it was
            renderer.draw(camera(10_000_000, 4))
        assert same(everything(renderer), expected[first.width])
        renderer.draw(then, weight_maps=False)
        assert same(everything(renderer), expected[then.width])


def test_the_context_goes_while_the_renderer_lives(gl, precision):
    scene, seen = all_around(5), camera(20, 16, 20.0)
    expected = fresh(gl, precision, scene, seen)
    lost = offscreen_context()
    orphan = SplatRenderer(lost, precision)
    orphan.set_scene(scene)
    orphan.ask(question(scene))
    orphan.draw(seen, weight_maps=False)  # half a frame
    lost.release()
    again = offscreen_context()
    heir = SplatRenderer(again, precision)
    heir.set_scene(scene)
    heir.ask(question(scene))
    heir.draw(seen)
    orphan.release()  # its names now name the heir's objects
    orphan.release()
    with pytest.raises(GraphicsError, match="context"):
        orphan.draw(seen)
    assert same(everything(heir), expected) and again.error == "GL_NO_ERROR"
    heir.release()
    again.release()
    gl.__enter__()  # the context of all other tests is current again
    assert same(fresh(gl, precision, scene, seen), expected)
