"""What files say of their splats beside the numbers: that they are to be drawn antialiased; their axes."""

import gzip
import json
import struct
import zipfile
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.base.formats import AXES
from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export import export, read, spz
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.joining import join_scenes
from langflash_core.scene.standing import on_its_head
from langflash_core.types import Gaussians, Scene
from tests.app.cli.conftest import stripes
from tests.boxroom import box_room
from tests.export.splats import ply_bytes, random_gaussians, stored_columns

SAID = "The scene was made for smoothed splats, which are drawn as plain ones here."
KINDS = (".ply", ".compressed.ply", ".sog", "meta.json", ".spz", ".langflash")


def named(folder: Path, kind: str) -> Path:
    folder.mkdir(exist_ok=True)
    return folder / (kind if kind == "meta.json" else f"a{kind}")


def made(antialiased: bool = True, count: int = 20) -> Scene:
    return bare_scene(random_gaussians(count, 1), "made").with_record(antialiased=antialiased)


def ply(folder: Path, header: str = "", **columns: np.ndarray) -> Scene:
    """A plain PLY with more in its header (lines behind BEFORE) or more properties."""
    (folder / "a.ply").write_bytes(ply_bytes({**stored_columns(), **columns}, header=header))
    return read(folder / "a.ply")


# Antialiased


@pytest.mark.parametrize("antialiased", [True, False])
@pytest.mark.parametrize(("first", "second"), [*pairwise(KINDS), (KINDS[-1], KINDS[0])])
def test_the_mark_makes_the_way_out_of_and_into_every_format(tmp_path, first, second, antialiased):
    one, two = named(tmp_path / "one", first), named(tmp_path / "two", second)
    export(made(antialiased), one)
    export(read(one), two)
    record = read(two).record
    assert record.antialiased is antialiased
    assert record.warnings.count(SAID) == int(antialiased)


def test_the_marks_stand_where_other_programs_look_for_them(tmp_path):
    for kind in (".ply", ".compressed.ply", ".sog"):
        export(made(), tmp_path / f"a{kind}")
    for kind in (".ply", ".compressed.ply"):
        header = (tmp_path / f"a{kind}").read_bytes().split(b"end_header\n")[0]
        assert b"\ncomment SplatRenderMode: mip\n" in header
    with zipfile.ZipFile(tmp_path / "a.sog") as archive:
        assert json.loads(archive.read("meta.json"))["model"] == "antialiased"
    for version in (2, 3):
        spz.write_spz(made(), tmp_path / "a.spz", version=version)
        assert gzip.decompress((tmp_path / "a.spz").read_bytes())[14] == 1
        assert read(tmp_path / "a.spz").record.antialiased


@pytest.mark.parametrize(
    ("comments", "antialiased"),
    [
        (["SplatRenderMode: mip"], True),  # Brush
        (["splatrendermode: MIP "], True),
        (["antialiased 1"], True),  # Postshot
        (["Exported from Brush", "Vertical axis: y", "SplatRenderMode: mip"], True),
        (["SplatRenderMode: mip\r"], True),
        (["SplatRenderMode: default"], False),
        (["antialiased 0"], False),
        (["SplatRenderMode: mip", "antialiased 0"], False),  # the last one wins
        (["antialiased 0", "SplatRenderMode: mip"], True),
        (["not antialiased 1"], False),
        (["a comment on end_header", "antialiased 1"], True),
        ([], False),
    ],
)
def test_comments_of_a_ply(tmp_path, comments, antialiased):
    scene = ply(tmp_path, "\n".join(f"BEFORE comment {comment}" for comment in comments))
    assert scene.record.antialiased is antialiased
    assert scene.record.warnings == ((SAID,) if antialiased else ())


def test_what_stands_behind_the_header_is_no_comment(tmp_path):
    content = ply_bytes(stored_columns())
    lists = content.replace(b"end_header", b"element face 1\nproperty list uchar int i\nend_header")
    (tmp_path / "a.ply").write_bytes(lists + b"\ncomment SplatRenderMode: mip\n")
    assert not read(tmp_path / "a.ply").record.antialiased


def test_splats_of_a_kind_that_is_not_known_are_said(tmp_path):
    scene = ply(tmp_path, "BEFORE comment SplatRenderMode: foam")
    assert scene.record.warnings and "not known here (foam)" in scene.record.warnings[0]
    assert "flat splats" in ply(tmp_path, "BEFORE comment SplatRenderMode: 2dgs").record.warnings[0]
    export(made(False), tmp_path / "meta.json")
    meta = json.loads((tmp_path / "meta.json").read_bytes())
    for model, said in (("2dgs", "flat splats"), ("foam", "not known here (foam)"), ("default", "")):
        (tmp_path / "meta.json").write_text(json.dumps({**meta, "model": model}))
        record = read(tmp_path / "meta.json").record
        assert not record.antialiased and said in "".join(record.warnings)
        assert bool(record.warnings) is bool(said)


def test_the_filter_of_mip_splatting_widens_and_dims(tmp_path):
    columns = stored_columns()
    radii = np.abs(np.random.default_rng(1).normal(0, 0.01, 50)).astype(np.float32)
    radii[:3] = 0
    found = ply(tmp_path, filter_3D=radii)
    assert found.record.antialiased and found.record.warnings == (SAID,)
    logs = np.stack([columns[f"scale_{axis}"] for axis in range(3)], 1).astype(np.float64)
    squares = np.exp(2 * logs)
    wider = squares + np.square(radii.astype(np.float64))[:, None]
    logits = columns["opacity"].astype(np.float64)
    opacities = np.sqrt(squares.prod(1) / wider.prod(1)) / (1 + np.exp(-logits))
    # float32: logarithms of scales are below 16, so within 16 * 2^-24 = 1e-6 of themselves, logits likewise.
    assert np.allclose(found.gaussians.scales.numpy(), np.sqrt(wider), rtol=4e-6, atol=0)
    assert np.allclose(found.gaussians.opacities.numpy(), opacities, rtol=4e-6, atol=1e-7)
    plain = ply(tmp_path)
    assert torch.equal(found.gaussians.scales[:3], plain.gaussians.scales[:3])
    assert torch.equal(found.gaussians.opacities[:3], plain.gaussians.opacities[:3])


def test_the_filter_is_written_as_what_it_did(tmp_path):
    found = ply(tmp_path, filter_3D=np.full(50, 0.01, np.float32))
    export(found, tmp_path / "b.ply")
    assert b"filter_3D" not in (tmp_path / "b.ply").read_bytes()
    again = read(tmp_path / "b.ply")
    assert again.record.antialiased
    assert torch.allclose(again.gaussians.scales, found.gaussians.scales, rtol=4e-6)
    assert torch.allclose(again.gaussians.opacities, found.gaussians.opacities, atol=1e-6)


def test_a_filter_of_half_floats_typed_ushort(tmp_path):
    columns = {**stored_columns(), "filter_3D": np.full(50, 0.01, np.float32)}
    halves = {name: values.astype(np.float16) for name, values in columns.items()}
    (tmp_path / "a.ply").write_bytes(ply_bytes({name: each.view(np.uint16) for name, each in halves.items()}))
    found = read(tmp_path / "a.ply")
    meant = ply(tmp_path, **{name: values.astype(np.float32) for name, values in halves.items()})
    assert found.record.antialiased and SAID in found.record.warnings
    assert torch.equal(found.gaussians.scales, meant.gaussians.scales)
    assert torch.equal(found.gaussians.opacities, meant.gaussians.opacities)


def test_filters_that_are_no_numbers_leave_their_splats_out(tmp_path):
    radii = np.full(50, 0.01, np.float32)
    radii[:2] = np.nan, np.inf
    scene = ply(tmp_path, filter_3D=radii)
    assert len(scene.gaussians) == 48 and "2 of 50" in scene.record.warnings[0]


def test_with_a_filter_nothing_is_guessed(tmp_path):
    """Its writer stores logits, also where all lie between 0 and 1."""
    between = np.linspace(0.1, 0.9, 50).astype(np.float32)
    guessed = ply(tmp_path, opacity=between)
    assert "not as logits" in guessed.record.warnings[0]
    known = ply(tmp_path, opacity=between, filter_3D=np.zeros(50, np.float32))
    assert known.record.warnings == (SAID,)
    assert torch.allclose(known.gaussians.opacities, torch.from_numpy(between).sigmoid(), atol=1e-6)


def test_the_mark_outlives_language_beside_a_ply(tmp_path):
    export(stripes(), tmp_path / "a.ply")
    content = (tmp_path / "a.ply").read_bytes()
    (tmp_path / "a.ply").write_bytes(content.replace(b"\nelement", b"\ncomment antialiased 1\nelement", 1))
    again = read(tmp_path / "a.ply")
    assert again.semantics.num_atoms and again.record.antialiased
    export(again, tmp_path / "b.glb")
    assert read(tmp_path / "b.glb").record.antialiased


def test_two_scenes_as_one_are_antialiased_where_both_are():
    for first, second in ((True, True), (True, False), (False, True), (False, False)):
        both = join_scenes(made(first), made(second))
        assert both.record.antialiased is (first and second)


def test_a_mark_that_is_none_is_refused(tmp_path):
    from langflash_core.scene.record import from_json

    assert from_json({"antialiased": True}).antialiased and not from_json({}).antialiased
    with pytest.raises(ValueError, match="antialiased: expected true or false, received 'yes'"):
        from_json({"antialiased": "yes"})


# Axes of a .spz


def half_around(gaussians: Gaussians) -> Gaussians:
    """Turned by 180 degrees about x."""
    signs = gaussians.means.new_tensor([1.0, -1, -1])
    quats = gaussians.quats * gaussians.quats.new_tensor([1.0, 1, -1, -1])
    return replace(gaussians, means=gaussians.means * signs, quats=quats)


def ahead(count: int = 300) -> Gaussians:
    """What photos at the origin show, +z being ahead."""
    drawn = random_gaussians(count)
    means = torch.tanh(drawn.means) + torch.tensor([0.0, 0.0, 3.0])
    return replace(drawn, means=means, opacities=drawn.opacities.clamp_min(0.5))


def room(*sheets: tuple[float, float]) -> Gaussians:
    """Level sheets around the origin, each at a height (up is -y) and so wide, and things in between."""
    rng = torch.Generator().manual_seed(0)
    parts = []
    for height, width in sheets:
        means = (torch.rand(400, 3, generator=rng) - 0.5) * width
        means[:, 1] = -height
        parts.append((means, torch.tensor([0.1, 0.005, 0.1])))
    parts.append(((torch.rand(400, 3, generator=rng) - 0.5) * 2, torch.tensor([0.03, 0.03, 0.03])))
    means = torch.cat([means for means, _ in parts])
    scales = torch.cat([scale.expand(400, 3) for _, scale in parts])
    count = len(means)
    quats = torch.tensor([1.0, 0, 0, 0]).repeat(count, 1)
    return Gaussians(means, quats, scales, torch.full((count,), 0.9), torch.zeros(count, 1, 3))


def written(folder: Path, gaussians: Gaussians) -> Path:
    """A .spz whose numbers are those of a PLY, without a word of it, as SuperSplat and splat-transform do."""
    export(bare_scene(half_around(gaussians), "made"), folder / "a.spz")
    return folder / "a.spz"


def test_numbers_of_a_ply_are_read_as_they_are_told(tmp_path):
    gaussians = ahead()
    path = written(tmp_path, gaussians)
    turned, right = read(path), read(path, axes="rdf")
    # A step of the fraction is 2^-16, the farthest mean 4.
    assert torch.allclose(right.gaussians.means, gaussians.means, atol=1e-5)
    assert torch.allclose(turned.gaussians.means, half_around(gaussians).means, atol=1e-5)
    assert [("--axes rdf" in "".join(scene.record.warnings)) for scene in (turned, right)] == [True, False]
    assert torch.equal(read(path, axes="RUB").gaussians.means, turned.gaussians.means)


@pytest.mark.parametrize("version", [2, 3, 4])
def test_told_axes_are_written_and_named(tmp_path, version):
    if version == 4:
        pytest.importorskip("zstandard")
    scene = bare_scene(ahead(), "made")
    spz.write_spz(scene, tmp_path / "a.spz", version=version, axes="rdf")
    content = (tmp_path / "a.spz").read_bytes()
    plain = content if version == 4 else gzip.decompress(content)
    record = struct.pack("<III", 0xADBE0003, 4, 6)  # RDF is the sixth
    assert plain[14] == 2
    if version == 4:
        assert plain[32:44] == record and int.from_bytes(plain[16:20], "little") == 44
    else:
        assert plain.endswith(record)
        first = int.from_bytes(plain[16:19], "little", signed=True) / (1 << plain[13])
        assert first == pytest.approx(float(scene.gaussians.means[0, 0]), abs=1e-4)
        down = int.from_bytes(plain[19:22], "little", signed=True) / (1 << plain[13])
        assert down == pytest.approx(float(scene.gaussians.means[0, 1]), abs=1e-4)  # not turned
    found = read(tmp_path / "a.spz")
    assert torch.allclose(found.gaussians.means, scene.gaussians.means, atol=1e-5)
    assert found.record.warnings == ()


@pytest.mark.parametrize("axes", AXES)
def test_every_axes_make_the_round_trip(tmp_path, axes):
    scene = bare_scene(random_gaussians(60, 1), "made")
    export(scene, tmp_path / "a.spz", axes=axes)
    found = read(tmp_path / "a.spz")
    assert torch.allclose(found.gaussians.means, scene.gaussians.means, atol=1e-5)
    alike = (found.gaussians.quats * scene.gaussians.quats).sum(-1).abs()
    assert float(alike.min()) > 1 - 1e-5  # half the angle that smallest three leave, .0025, as a cosine
    assert found.record.warnings == ()


def test_a_file_that_names_its_axes_is_believed(tmp_path):
    scene = bare_scene(ahead(), "made")
    export(scene, tmp_path / "a.spz", axes="rub")
    assert read(tmp_path / "a.spz", axes="rub").record.warnings == ()
    found = read(tmp_path / "a.spz", axes="rdf")
    assert torch.allclose(found.gaussians.means, scene.gaussians.means, atol=1e-5)
    assert found.record.warnings == ("The file names its own axes, rub, and was read by those, not by rdf.",)


def test_axes_of_other_files_and_axes_that_are_none_are_refused(tmp_path):
    scene = bare_scene(ahead(), "made")
    for axes, name, said in (("rdf", "a.ply", "of a .spz alone"), ("xyz", "a.spz", "axes xyz are unknown")):
        with pytest.raises(OutputError, match=said):
            export(scene, tmp_path / name, axes=axes)
        assert not list(tmp_path.iterdir())
        with pytest.raises(SceneFileError, match=said):
            read(tmp_path / name, axes=axes)


@pytest.mark.parametrize(
    ("sheets", "expected"),
    [
        ([(-1.0, 4.0)], False),  # a floor
        ([(1.0, 4.0)], True),  # a floor above
        ([(-1.0, 4.0), (1.0, 4.0)], False),  # with a ceiling nothing is certain
        ([(-1.0, 2.0), (-0.2, 1.0), (1.0, 4.0)], False),
        ([], False),
    ],
)
def test_a_floor_above_everything_stands_on_its_head(tmp_path, sheets, expected):
    gaussians = room(*sheets)
    assert on_its_head(gaussians) is expected
    export(bare_scene(gaussians, "made"), tmp_path / "a.spz")
    assert bool(read(tmp_path / "a.spz").record.warnings) is expected
    if expected:
        assert read(written(tmp_path, gaussians)).record.warnings == ()


def test_scenes_that_stand_are_not_said_to_hang():
    fixtures = Path(__file__).parents[1] / "fixtures" / "scenes"
    scenes = [box_room(), box_room(pitch=-10), stripes(), made()]
    for scene in [*scenes, *map(read, sorted(fixtures.glob("*.langflash")))]:
        assert not on_its_head(scene.gaussians)


def test_nothing_that_is_seen_hangs_nowhere():
    faint = ahead()
    assert on_its_head(half_around(faint))
    assert not on_its_head(replace(half_around(faint), opacities=torch.zeros(len(faint))))
    one = half_around(faint).map(lambda values: values[:1])
    assert on_its_head(one) and not on_its_head(half_around(one))
