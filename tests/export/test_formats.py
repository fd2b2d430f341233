"""Every splat format: what a round trip keeps, its axes and layout by hand, and what is refused."""

import gzip
import json
import struct
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from torch.nn.functional import normalize

from langflash_core.base.outputs import DROPPED, SCENES_IN, SCENES_OUT
from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export import READERS, WRITERS, export, read, spz
from langflash_core.export.packing import morton_order
from langflash_core.geometry.harmonics import SH_C0, sh_to_colour
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.checks import check_scene
from langflash_core.types import Gaussians
from tests.export.splats import glb_column, glb_parts, ksplat_bytes, random_gaussians

HALF = 0.5 / 255 + 1e-6  # of a step of 8 bits


@dataclass(frozen=True)
class Kept:
    """Bounds on what a format loses: absolute errors, angles in radians, logarithms of scales.

    scales, colours, rest: (lowest, highest) that the format holds, in its own terms.
    """

    means: float = 0.0
    angle: float = 1e-3  # float32: acos of a dot product
    scales: float = 2e-6  # logarithms in float32, as `test_ply.py` allows
    opacities: float = 1e-6
    colours: float = 1e-6  # of 0.5 + SH_C0 f_dc
    rest: float = 0.0
    scale_range: tuple[float, float] = (-70.0, 70.0)
    colour_range: tuple[float, float] = (-1e9, 1e9)
    rest_range: tuple[float, float] = (-1e9, 1e9)
    along_a_curve: bool = False
    degree: int = 3  # of harmonics, at most


# Three entries within e = 1 / 1022 / sqrt(2) of themselves and, at worst, of four equal ones, the fourth
# within 3 e: |dq| = sqrt(12) e = .0024, twice that as an angle.
SMALLEST_THREE = 0.005


def spz_kept(furthest: float, angle: float) -> Kept:
    """A step of the fraction that the scene leaves room for; 5 and 4 bits of harmonics in [-1, 1]."""
    bits = next(b for b in range(16, -1, -1) if round(furthest * 2**b) < 2**23 or not b)
    return Kept(
        means=0.5 / 2**bits + furthest * 1e-6,
        angle=angle,
        scales=1 / 32 + 1e-5,
        opacities=HALF,
        colours=SH_C0 / 0.15 * HALF,
        rest=9 / 128,  # half a step of 16 and half a step of rounding before it
        scale_range=(-10, 255 / 16 - 10),
        colour_range=(0.5 - SH_C0 / 0.3, 0.5 + SH_C0 / 0.3),
        rest_range=(-1, 1 - 1 / 128),
    )


def bounds(kind: str, gaussians: Gaussians) -> Kept:
    """What this format is to keep of these Gaussians."""
    means = gaussians.means.double()
    extent = float((means.amax(0) - means.amin(0)).max())
    furthest = float(means.abs().max())
    logs = gaussians.scales.double().log()
    colours = 0.5 + SH_C0 * gaussians.sh[:, 0].double()
    if kind == ".spz":
        return spz_kept(furthest, SMALLEST_THREE)
    if kind == ".compressed.ply":
        return Kept(
            means=extent / 1023 / 2 + furthest * 1e-6,
            angle=SMALLEST_THREE,
            scales=float((logs.amax(0) - logs.amin(0)).max()) / 1023 / 2 + 1e-5,
            opacities=HALF,
            colours=float((colours.amax(0) - colours.amin(0)).max()) / 255 / 2 + 1e-5,
            rest=1 / 64 + 1e-5,
            scale_range=(-20, 20),
            rest_range=(-4 + 1 / 64, 4 - 1 / 64),
            along_a_curve=True,
        )
    if kind in (".sog", "meta.json"):
        logarithms = 2 * float(torch.log1p(means.abs()).max())
        rest = gaussians.sh[:, 1:]
        return Kept(
            means=logarithms / 65535 * (1 + furthest) + 1e-6,
            angle=0.02,  # three entries within 1 / 510 * sqrt(2) of themselves
            # At least half of the book lies evenly; k-means moves it towards where there is more.
            scales=float(logs.amax() - logs.amin()) / 64 + 1e-5,
            opacities=HALF,
            colours=float(colours.amax() - colours.amin()) / 64 + 1e-5,
            rest=float(rest.amax() - rest.amin()) / 64 + 1e-5 if rest.numel() else 0.0,
            along_a_curve=True,
        )
    if kind == ".splat":
        return Kept(angle=0.04, opacities=HALF, colours=HALF, colour_range=(0, 1), degree=0)
    return Kept()


def compare(kind: str, before: Gaussians, after: Gaussians) -> None:
    kept = bounds(kind, before)
    if kept.along_a_curve:
        order = morton_order(before.means.double().numpy())
        before = before.map(lambda values: values[order])
    assert len(before) == len(after)
    assert float((after.means - before.means).abs().max()) <= kept.means
    # |q - p| or |q + p| is twice the sine of a quarter of the angle between the rotations.
    apart = torch.minimum(
        (after.quats - before.quats).double().norm(dim=-1), (after.quats + before.quats).double().norm(dim=-1)
    )
    assert float(4 * torch.asin((apart / 2).clamp(max=1)).max()) <= kept.angle
    logs = before.scales.double().log().clamp(*kept.scale_range)
    assert float((after.scales.double().log() - logs).abs().max()) <= kept.scales
    assert float((after.opacities - before.opacities).abs().max()) <= kept.opacities
    shown = (0.5 + SH_C0 * before.sh[:, 0]).clamp(*kept.colour_range)
    assert float((0.5 + SH_C0 * after.sh[:, 0] - shown).abs().max()) <= kept.colours
    num_bases = min(before.sh.shape[1], (kept.degree + 1) ** 2)
    assert after.sh.shape == (len(before), num_bases, 3)
    if num_bases > 1:
        rest = before.sh[:, 1:num_bases].clamp(*kept.rest_range)
        assert float((after.sh[:, 1:] - rest).abs().max()) <= kept.rest


@dataclass(frozen=True)
class Splats:
    """1 to 600 Gaussians of degree 0 to 4, wherever and however large; one of them on an axis."""

    count: int
    degree: int
    seed: int
    decade: float
    shift: tuple[float, float, float]
    axis: int

    def made(self) -> Gaussians:
        drawn = random_gaussians(self.count, self.degree, self.seed)
        size = 10.0**self.decade
        quats = drawn.quats.clone()
        quats[0] = torch.eye(4)[self.axis]
        means = (drawn.means + torch.tensor(self.shift)) * size
        return Gaussians(means, quats, drawn.scales * size, drawn.opacities, drawn.sh)


SPLATS = st.builds(
    Splats,
    count=st.sampled_from([1, 2, 3, 255, 256, 257, 600]),
    degree=st.integers(0, 4),
    seed=st.integers(0, 2**16),
    decade=st.floats(-3, 3),
    shift=st.tuples(*[st.floats(-5, 5)] * 3),
    axis=st.integers(0, 3),
)


@pytest.mark.parametrize(
    "kind", [kind for kind in SCENES_OUT if kind in SCENES_IN and kind not in (".langflash", ".usd", ".usdz")]
)
@settings(
    max_examples=12,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    phases=(Phase.explicit, Phase.reuse, Phase.generate),  # six numbers are small enough as they are drawn
)
@given(splats=SPLATS)
def test_a_round_trip_keeps_what_the_format_can(tmp_path, kind, splats):
    gaussians = splats.made()
    if kind.startswith(".usd"):
        pytest.importorskip("pxr")
    path = tmp_path / (kind if kind == "meta.json" else f"a{kind}")
    export(bare_scene(gaussians, "made"), path)
    scene = read(path)
    check_scene(scene)
    compare(kind, gaussians, scene.gaussians)


@pytest.mark.parametrize("version", [2, 3, 4])
def test_every_version_of_spz_makes_the_round_trip(tmp_path, version):
    if version == 4:
        pytest.importorskip("zstandard")
    gaussians = random_gaussians(300, 3)
    spz.write_spz(bare_scene(gaussians, "made"), tmp_path / "a.spz", version=version)
    head = (tmp_path / "a.spz").read_bytes()
    assert head[:4] == b"NGSP" if version == 4 else head[:2] == b"\x1f\x8b"
    after = read(tmp_path / "a.spz").gaussians
    if version > 2:
        return compare(".spz", gaussians, after)
    # Three entries within 1 / 255 of themselves, and w from them: worst where w is small.
    assert float((after.quats * gaussians.quats).sum(-1).abs().min()) > 0.99
    assert torch.allclose(after.means, gaussians.means, atol=1e-5)


@pytest.mark.parametrize(
    "kind", [".html", *(k for k in SCENES_OUT if k not in (".langflash", ".ply", ".splat"))]
)
def test_an_empty_scene_is_refused_and_nothing_written(tmp_path, kind):
    if kind.startswith(".usd"):
        pytest.importorskip("pxr")
    full = bare_scene(random_gaussians(2), "made")
    empty = full.rows(torch.zeros(2, dtype=torch.bool))
    with pytest.raises(OutputError, match="no Gaussians"):
        export(empty, tmp_path / (kind if kind == "meta.json" else f"a{kind}"))
    assert not list(tmp_path.iterdir())


def test_the_list_of_names_is_the_table():
    whole = {"cameras.txt", "transforms.json", ".html"}
    assert {kind for kind, own in WRITERS.items() if "of_scene" in own} == set(SCENES_OUT) | whole
    assert set(DROPPED) == set(READERS) - {"meta.json"}


def seen_colours(gaussians: Gaussians, directions: torch.Tensor) -> torch.Tensor:
    return sh_to_colour(gaussians.sh, directions.expand(len(gaussians), 3))


@pytest.mark.parametrize(
    ("letters", "matrix"),
    [
        ("RUB", [[1, 0, 0], [0, -1, 0], [0, 0, -1]]),
        ("LUF", [[-1, 0, 0], [0, -1, 0], [0, 0, 1]]),
        ("LDF", [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]),  # a mirror
        ("RFU", [[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
    ],
)
def test_axes_turn_positions_shapes_and_colours_together(letters, matrix):
    """A Gaussian seen along d before looks the same seen along M d after."""
    from langflash_core.export.packing import transform_rows
    from langflash_core.export.stored import Rows
    from langflash_core.geometry.turning import axes_matrix
    from tests.geometry.spread import covariances

    expected = torch.tensor(matrix, dtype=torch.float64)
    assert torch.equal(axes_matrix(letters), expected)
    before = random_gaussians(60, 3)
    moved = transform_rows(
        Rows(*(v.numpy() for v in (before.means, before.quats, before.scales, before.opacities, before.sh))),
        expected,
    )
    after = Gaussians(*(torch.from_numpy(values) for values in moved.all()))
    change = expected.float()
    assert torch.equal(after.means, before.means @ change.T)
    sigma = change @ covariances(before.quats, before.scales) @ change.T
    assert torch.allclose(covariances(after.quats, after.scales), sigma, rtol=1e-4, atol=1e-6)
    for direction in normalize(torch.randn(8, 3, generator=torch.Generator().manual_seed(1)), dim=-1):
        assert torch.allclose(
            seen_colours(before, direction), seen_colours(after, change @ direction), atol=2e-5
        )


def test_spz_by_hand(tmp_path):
    """One Gaussian of version 3, laid out after the format's README: up and back are positive there."""
    half = 511 << 0  # 1 / sqrt(2) in 9 bits
    quat = (3 << 30) | (half << 20)  # w largest, x = 1 / sqrt(2), y = z = 0
    places = b"".join(int(v * 4096).to_bytes(3, "little", signed=True) for v in (1.5, -2.0, 0.25))
    body = places + bytes([128]) + bytes([255, 128, 0]) + bytes([160, 176, 144]) + struct.pack("<I", quat)
    rest = bytes([128 + 64] * 3 + [128] * 6)  # basis -y
    head = struct.pack("<4sIIBBBB", b"NGSP", 3, 1, 1, 12, 0, 0)
    (tmp_path / "a.spz").write_bytes(gzip.compress(head + body + rest))
    found = read(tmp_path / "a.spz").gaussians
    assert found.means.tolist() == [[1.5, 2.0, -0.25]]
    assert torch.allclose(found.scales.log(), torch.tensor([[0.0, 1.0, -1.0]]), atol=1e-6)
    assert torch.allclose(found.quats, torch.tensor([[0.5**0.5, 0.5**0.5, 0, 0]]), atol=1e-6)
    assert found.opacities.tolist() == pytest.approx([128 / 255])
    assert torch.allclose(found.sh[0, 0], torch.tensor([0.5, 128 / 255 - 0.5, -0.5]) / 0.15, atol=1e-5)
    assert found.sh[0, 1].tolist() == [-0.5] * 3  # y has changed its sign
    assert found.sh[0, 2:].abs().max() == 0


def test_spz_without_zstd(tmp_path, monkeypatch):
    pytest.importorskip("zstandard")
    scene = bare_scene(random_gaussians(5), "made")
    spz.write_spz(scene, tmp_path / "four.spz", version=4)
    monkeypatch.setattr("langflash_core.export.packing._zstandard", lambda: None)
    monkeypatch.setattr("langflash_core.export.packing._own_zstd", lambda: None)
    with pytest.raises(SceneFileError, match=r"langflash\[formats\]"):
        read(tmp_path / "four.spz")
    export(scene, tmp_path / "plain.spz")
    assert (tmp_path / "plain.spz").read_bytes()[:2] == b"\x1f\x8b"  # version 3 needs nothing
    assert len(read(tmp_path / "plain.spz").gaussians) == 5


def test_spz_keeps_far_scenes_and_says_what_is_too_far(tmp_path):
    gaussians = random_gaussians(4)
    means = torch.tensor([[1e6, -8e6, 0.0], [1, 2, 3], [4, 5, 6], [7, 8, 9]])
    moved = replace(gaussians, means=means)
    export(bare_scene(moved, "made"), tmp_path / "a.spz")
    assert torch.equal(read(tmp_path / "a.spz").gaussians.means, means)
    too_far = replace(moved, means=means * 2)
    with pytest.raises(OutputError, match=r"a \.spz ends at"):
        export(bare_scene(too_far, "made"), tmp_path / "b.spz")


@pytest.mark.parametrize("level", [0, 1, 2])
@pytest.mark.parametrize("degree", [0, 1, 2])
def test_ksplat_of_each_compression(tmp_path, level, degree):
    """Files of the tests' own writer, after the layout in GaussianSplats3D."""
    gaussians = random_gaussians(700, degree)
    (tmp_path / "a.ksplat").write_bytes(ksplat_bytes(gaussians, level))
    scene = read(tmp_path / "a.ksplat")
    check_scene(scene)
    after = scene.gaussians
    assert torch.allclose(after.means, gaussians.means, atol=2e-4 if level else 1e-6)  # half a step
    assert torch.allclose(after.scales, gaussians.scales, rtol=1e-6 if level == 0 else 1e-3, atol=1e-7)
    assert float((after.quats * gaussians.quats).sum(-1).abs().min()) > 1 - 1e-5
    assert float((after.opacities - gaussians.opacities).abs().max()) <= HALF
    shown = (0.5 + SH_C0 * gaussians.sh[:, 0]).clamp(0, 1)
    assert float((0.5 + SH_C0 * after.sh[:, 0] - shown).abs().max()) <= HALF
    if degree:
        rest = gaussians.sh[:, 1:].clamp(-1.5, 1.5) if level == 2 else gaussians.sh[:, 1:]
        assert float((after.sh[:, 1:] - rest).abs().max()) <= (0.0, 2e-3, 1.5 / 255 + 1e-6)[level]


def test_compressed_ply_by_its_header_not_its_name(tmp_path):
    gaussians = random_gaussians(300, 1)
    export(bare_scene(gaussians, "made"), tmp_path / "a.compressed.ply")
    (tmp_path / "a.compressed.ply").rename(tmp_path / "plain.ply")
    compare(".compressed.ply", gaussians, read(tmp_path / "plain.ply").gaussians)


def test_sog_is_a_zip_of_pictures_and_a_folder_of_the_same(tmp_path):
    scene = bare_scene(random_gaussians(300, 1), "made")
    export(scene, tmp_path / "a.sog")
    export(scene, tmp_path / "folder" / "meta.json")
    with zipfile.ZipFile(tmp_path / "a.sog") as archive:
        names = set(archive.namelist())
        for name in names:
            assert archive.read(name) == (tmp_path / "folder" / name).read_bytes()
    assert {"meta.json", "means_l.webp", "means_u.webp", "shN_centroids.webp", "shN_labels.webp"} <= names
    assert torch.equal(
        read(tmp_path / "a.sog").gaussians.means, read(tmp_path / "folder" / "meta.json").gaussians.means
    )


def test_a_large_palette_is_found_by_k_means(tmp_path):
    gaussians = random_gaussians(9000, 1)
    export(bare_scene(gaussians, "made"), tmp_path / "a.sog")
    after = read(tmp_path / "a.sog").gaussians
    order = morton_order(gaussians.means.double().numpy())
    wrong = after.sh[:, 1:] - gaussians.sh[order, 1:]
    # 8,192 entries for 9,000 vectors of nine normal numbers: most are nearly exact.
    assert float(wrong.abs().median()) < 0.03 and float(wrong.square().mean()) < 0.1


def test_glb_says_what_khronos_asks_for(tmp_path):
    gaussians = random_gaussians(20, 2)
    export(bare_scene(gaussians, "made"), tmp_path / "a.glb")
    document, _ = glb_parts(tmp_path / "a.glb")
    assert document["extensionsUsed"] == ["KHR_gaussian_splatting"] and "extensionsRequired" not in document
    primitive = document["meshes"][0]["primitives"][0]
    assert primitive["mode"] == 0
    own = primitive["extensions"]["KHR_gaussian_splatting"]
    assert own == {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}

    def column(name: str, kind: str, width: int) -> np.ndarray:
        return glb_column(tmp_path / "a.glb", primitive["attributes"][name], kind, width)

    flip = np.array([-1, -1, 1], np.float32)
    assert np.array_equal(column("POSITION", "<f4", 3), gaussians.means.numpy() * flip)
    assert document["accessors"][0]["min"] == (gaussians.means.numpy() * flip).min(0).tolist()
    assert np.allclose(column("KHR_gaussian_splatting:SCALE", "<f4", 3), gaussians.scales)
    assert np.allclose(column("KHR_gaussian_splatting:OPACITY", "<f4", 1)[:, 0], gaussians.opacities)
    assert np.allclose(column("KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", "<f4", 3), gaussians.sh[:, 0])
    # Degree 1 is -y, z, -x: y and x have turned.
    signs = ((1, -1), (2, 1), (3, -1))
    for place, (basis, sign) in enumerate(signs):
        stored = column(f"KHR_gaussian_splatting:SH_DEGREE_1_COEF_{place}", "<f4", 3)
        assert np.allclose(stored, sign * gaussians.sh[:, basis].numpy())
    shown = (0.5 + SH_C0 * gaussians.sh[:, 0].numpy()).clip(0, 1)
    linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
    assert np.allclose(column("COLOR_0", "<u2", 4)[:, :3] / 65535, linear, atol=1e-4)


def gltf_file(folder: Path, gaussians: Gaussians, node: dict, **own) -> Path:
    """A .gltf with its buffer beside it, and the primitive below one node."""
    export(bare_scene(gaussians, "made"), folder / "a.glb")
    document, buffer = glb_parts(folder / "a.glb")
    document["nodes"] = [{"children": [1]}, {"mesh": 0, **node}]
    document["buffers"][0]["uri"] = "numbers.bin"
    document["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"] |= own
    (folder / "numbers.bin").write_bytes(buffer)
    (folder / "b.gltf").write_text(json.dumps(document))
    return folder / "b.gltf"


def test_gltf_nodes_move_turn_and_scale(tmp_path):
    """A quarter turn about glTF's +z (forward, as ours), twice as large, one to glTF's right (our -x)."""
    gaussians = random_gaussians(30, 1)
    turn = {"rotation": [0, 0, 0.5**0.5, 0.5**0.5], "scale": [2, 2, 2], "translation": [-1, 0, 0]}
    after = read(gltf_file(tmp_path, gaussians, turn)).gaussians
    x, y, z = gaussians.means.unbind(-1)
    assert torch.allclose(after.means, torch.stack((-2 * y + 1, 2 * x, 2 * z), -1), atol=1e-5)
    assert torch.allclose(after.scales, 2 * gaussians.scales, rtol=1e-5)
    direction = torch.tensor([0.6, 0.0, 0.8])
    assert torch.allclose(
        seen_colours(gaussians, direction), seen_colours(after, torch.tensor([0.0, 0.6, 0.8])), atol=1e-5
    )


def test_gltf_in_linear_colours_becomes_srgb(tmp_path):
    gaussians = random_gaussians(30)
    gaussians = replace(gaussians, sh=gaussians.sh.clamp(-1.7, 1.7))
    after = read(gltf_file(tmp_path, gaussians, {}, colorSpace="lin_rec709_display")).gaussians
    linear = (0.5 + SH_C0 * gaussians.sh[:, 0]).clamp_min(0)
    srgb = torch.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert torch.allclose(0.5 + SH_C0 * after.sh[:, 0], srgb, atol=1e-5)


def test_gltf_without_splats_is_refused(tmp_path):
    (tmp_path / "mesh.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "meshes": []}))
    with pytest.raises(SceneFileError, match="no primitive with KHR_gaussian_splatting"):
        read(tmp_path / "mesh.gltf")


def test_usd_in_half_precision_and_z_up(tmp_path):
    """Half positions of a stage whose +z is up: (right, forward, up) is ours (x, z, -y)."""
    parts = ("Gf", "Usd", "UsdGeom", "UsdVol", "Vt")
    Gf, Usd, UsdGeom, UsdVol, Vt = (pytest.importorskip(f"pxr.{part}") for part in parts)
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    above = UsdGeom.Xform.Define(stage, "/Room")
    above.AddTranslateOp().Set(Gf.Vec3d(0, 0, 1))
    field = UsdVol.ParticleField3DGaussianSplat.Define(stage, "/Room/Splats")
    prim = field.GetPrim()
    prim.GetAttribute("positionsh").Set(Vt.Vec3hArray([(1, 2, 3)]))
    prim.GetAttribute("orientationsh").Set(Vt.QuathArray([Gf.Quath(1, 0, 0, 0)]))
    prim.GetAttribute("scalesh").Set(Vt.Vec3hArray([(0.5, 0.25, 2)]))
    prim.GetAttribute("opacitiesh").Set(Vt.HalfArray([0.75]))
    field.GetRadianceSphericalHarmonicsDegreeAttr().Set(0)
    name = "radiance:sphericalHarmonicsCoefficientsh"
    prim.GetAttribute(name).Set(Vt.Vec3hArray([(0.5, -0.5, 1)]))
    stage.Save()
    found = read(tmp_path / "a.usda").gaussians
    assert found.means.tolist() == [[1, -4, 2]]
    assert found.opacities.tolist() == [0.75] and found.sh[0, 0].tolist() == [0.5, -0.5, 1]
    assert found.scales.tolist() == [[0.5, 0.25, 2]]


def test_usd_that_is_absent_is_said(tmp_path, monkeypatch):
    monkeypatch.setattr("langflash_core.export.usd._pxr", lambda: None)
    monkeypatch.setattr("langflash_core.export.usd.is_installed", lambda: False)
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    with pytest.raises(SceneFileError, match=r"langflash\[usd\]"):
        read(tmp_path / "a.usda")
    with pytest.raises(OutputError, match=r"langflash\[usd\]"):
        export(bare_scene(random_gaussians(3), "made"), tmp_path / "b.usd")
    assert not (tmp_path / "b.usd").exists()


def test_the_table_in_the_guide_is_what_the_code_does():
    """A row a format: whether it is read and written, and its axes."""
    from langflash_core.export import gltf, usd

    guide = (Path(__file__).parents[2] / "GUIDE.md").read_text()
    section = guide.split("## Splat files")[1].split("\n#")[0]
    section = section.split("| colours of")[0]
    lines = [line for line in section.splitlines() if line.startswith("| `")]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
    axes = {"`.spz`": spz._STORED_AXES, "`.glb`": gltf._AXES, "`.usd`": usd._AXES["Y"]}
    read_kinds, written_kinds = set(), set()
    for kinds, ways, letters, *_ in rows:
        names = [kind.strip("` ") for kind in kinds.split(",")]
        read_kinds |= set(names if ways != "out" else ())
        written_kinds |= {name for name in names if ways in ("in, out", "out") or f"out (`{name}`)" in ways}
        assert letters == axes.get(kinds.split(",")[0], "RDF")
    assert read_kinds - {".compressed.ply"} == set(SCENES_IN) and written_kinds == set(SCENES_OUT)
