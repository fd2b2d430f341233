"""Numbers of .ply files that do not say how they are meant: read as the field reads them, or refused."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.base.records import World
from langflash_core.base.request import ExportRequest
from langflash_core.errors import SceneFileError
from langflash_core.export import export, read
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.level import upright
from langflash_core.lift import posed_views
from langflash_core.writing import write
from tests.app.cli.conftest import stripes
from tests.export import splats
from tests.export.splats import NAMES, ply_bytes, same, stored_columns

SURVEYED = (448_262.0, 5_411_932.0, 117.0)  # metres east, north (UTM) and up


def columns_of(count: int = 50, /, **changes: np.ndarray) -> dict[str, np.ndarray]:
    return {**stored_columns(count), **changes}


def gaussians_of(tmp_path, content: bytes):
    (tmp_path / "a.ply").write_bytes(content)
    return read(tmp_path / "a.ply").gaussians


def refusal(tmp_path, content: bytes) -> str:
    (tmp_path / "a.ply").write_bytes(content)
    return splats.refusal(lambda: read(tmp_path / "a.ply"))


def halves(columns):
    return {name: values.astype(np.float16) for name, values in columns.items()}


def without(columns, *names):
    return {name: values for name, values in columns.items() if name not in names}


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", ["half", "float16", "ushort", "uint16"])
def test_half_floats_are_read_under_every_name(tmp_path, kind, order):
    stored = halves(columns_of(600))
    plain = gaussians_of(tmp_path, ply_bytes({name: v.astype(np.float32) for name, v in stored.items()}))
    content = ply_bytes(stored, order).replace(b"property half", b"property " + kind.encode())
    assert same(gaussians_of(tmp_path, content), plain)
    said = read(tmp_path / "a.ply").record.warnings
    assert ("read as these" in " ".join(said)) == kind.startswith("u")


def test_few_rows_that_are_not_finite_do_not_make_halves_whole_numbers(tmp_path):
    stored = halves(columns_of(100))
    stored["x"][3] = np.nan
    content = ply_bytes(stored).replace(b"property half", b"property ushort")
    assert len(gaussians_of(tmp_path, content)) == 99


@pytest.mark.parametrize(
    ("fields", "kind"),
    [
        (NAMES, np.uint16),  # quantised: all of them
        (("x", "y", "z"), np.uint16),
        (("x", "y", "z"), np.int32),  # millimetres
        (("scale_0", "scale_1", "scale_2"), np.uint8),
        (("opacity",), np.uint8),
        (("rot_0", "rot_1", "rot_2", "rot_3"), np.int8),
        (("f_dc_1",), np.int16),
        (("filter_3D",), np.uint16),
    ],
)
@pytest.mark.parametrize("most", [100, 30_000, 65_536])
def test_whole_numbers_are_refused_by_name(tmp_path, fields, kind, most):
    rng = np.random.default_rng(0)
    most = min(most, np.iinfo(kind).max)
    changed = columns_of(300, **{field: rng.integers(0, most, 300).astype(kind) for field in fields})
    sentence = refusal(tmp_path, ply_bytes(changed))
    assert f"stores {next(name for name in changed if name in fields)} as whole numbers" in sentence
    assert np.dtype(kind).name in sentence


def test_whole_harmonics_are_refused(tmp_path):
    rest = {f"f_rest_{index}": np.full(50, index, np.uint8) for index in range(9)}
    assert "f_rest_0 as whole numbers" in refusal(tmp_path, ply_bytes(columns_of(**rest)))


def surveyed(count: int = 500) -> dict[str, np.ndarray]:
    """A room of Gaussians of 1 cm, in surveyed coordinates."""
    columns = columns_of(
        count, **{f"scale_{axis}": np.full(count, np.log(0.01), np.float32) for axis in range(3)}
    )
    rng = np.random.default_rng(1)
    return columns | {
        name: rng.uniform(-3, 3, count) + start for name, start in zip("xyz", SURVEYED, strict=True)
    }


@pytest.mark.parametrize("order", ["<", ">"])
def test_surveyed_coordinates_keep_their_millimetres(tmp_path, order):
    columns = surveyed()
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns, order))
    scene = read(tmp_path / "a.ply")
    shift = scene.record.shift
    assert shift is not None and np.allclose(shift, SURVEYED, atol=3)
    assert all(value.is_integer() for value in shift)
    assert f"{shift[1]:,.0f}" in scene.record.warnings[0] and "taken off" in scene.record.warnings[0]
    places = np.stack([columns[name] for name in "xyz"], 1)
    # Within 4 of 0, float32 rounds by at most 2^-23.
    assert np.abs(scene.gaussians.means.double().numpy() + shift - places).max() <= 2**-23


def test_surveyed_coordinates_that_floats_have_blurred_already_are_said(tmp_path):
    """Nobody gets the half metres back, but who made the file can write doubles."""
    columns = surveyed()
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns | {n: columns[n].astype(np.float32) for n in "xyz"}))
    record = read(tmp_path / "a.ply").record
    assert record.shift is None
    assert "steps of 0.5" in record.warnings[0] and "write doubles" in record.warnings[0]


def test_poses_in_surveyed_coordinates_are_shifted_with_the_scene(tmp_path):
    scene, photo = stripes(), io.BytesIO()
    Image.new("RGB", (56, 42), (90, 120, 60)).save(photo, "JPEG")
    posed = replace(scene, photos=(photo.getvalue(),) * scene.num_views)
    posed = posed.with_record(photos=tuple(f"{view}.jpg" for view in range(scene.num_views)))
    poses = tmp_path / "transforms.json"
    export(posed, poses)
    near = posed_views(poses, ())[1]
    said = json.loads(poses.read_text())
    for frame in said["frames"]:
        for axis in range(3):
            frame["transform_matrix"][axis][3] += SURVEYED[axis]
    poses.write_text(json.dumps(said))
    # A double has steps of 2^-30 there, and one product more; what is given is float32.
    assert torch.allclose(posed_views(poses, (), SURVEYED)[1], near, rtol=0, atol=1e-8)


def test_the_shift_is_put_back_in_a_ply_as_doubles(tmp_path):
    (tmp_path / "a.ply").write_bytes(ply_bytes(surveyed()))
    scene = read(tmp_path / "a.ply")
    export(scene, tmp_path / "a.langflash")
    kept = read(tmp_path / "a.langflash")
    assert kept.record.shift == scene.record.shift
    export(kept, tmp_path / "b.ply")
    content = (tmp_path / "b.ply").read_bytes()
    assert content.count(b"property double") == 3
    body = content.index(b"end_header\n") + 11
    row = np.dtype([("means", "<f8", 3), ("rest", "<f4", 14)])
    found = np.frombuffer(content[body:], row)["means"]
    whole = np.stack([surveyed()[name] for name in "xyz"], 1)
    assert np.abs(found - whole).max() <= 2**-23
    after = read(tmp_path / "b.ply")
    assert torch.equal(after.gaussians.means, scene.gaussians.means)
    assert after.record.shift == scene.record.shift


def test_language_still_fits_a_shifted_ply(tmp_path):
    """The side-car knows its Gaussians by their positions, to the last bit."""
    spoken = stripes()
    # As a surveyed file leaves them: multiples of the last bit of a double there, 2^-30.
    means = (spoken.gaussians.means * 2**20).round() / 2**20
    spoken = replace(spoken, gaussians=replace(spoken.gaussians, means=means)).with_record(shift=SURVEYED)
    export(spoken, tmp_path / "a.ply")
    after = read(tmp_path / "a.ply")
    assert after.semantics.num_atoms == spoken.semantics.num_atoms
    assert after.record.shift == SURVEYED


def test_other_formats_say_that_they_lack_the_shift(tmp_path):
    scene = stripes().with_record(shift=SURVEYED, world=World((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    for name in ("a.spz", "a.splat", "a.compressed.ply", "a.glb", "a.sog"):
        said = write(scene, ExportRequest(tmp_path / name))
        assert said.endswith("; its coordinates lack the (448,262, 5,411,932, 117) that was taken off"), name
    for name in ("a.ply", "a.langflash"):
        assert "lack" not in write(scene, ExportRequest(tmp_path / name))
    assert upright(scene).record.shift is None
    assert "lack" in write(scene, ExportRequest(tmp_path / "b.ply", upright=True))
    assert b"double" not in (tmp_path / "b.ply").read_bytes()[:2000]


@pytest.mark.parametrize(
    ("start", "size"),
    [
        (0.0, 0.01),  # a room around 0
        (3.0, 0.01),  # in front of a camera
        (3000.0, 0.3),  # 3 km away, where float32 has steps of a quarter of a millimetre
    ],
)
def test_doubles_of_which_float32_loses_nothing_are_not_shifted(tmp_path, start, size):
    columns = surveyed() | {f"scale_{axis}": np.full(500, np.log(size), np.float32) for axis in range(3)}
    for name in "xyz":
        columns[name] = np.random.default_rng(2).uniform(-1, 1, 500) * 20 * size + start
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns))
    record = read(tmp_path / "a.ply").record
    assert record.shift is None and not any("taken off" in said for said in record.warnings)


def test_doubles_beyond_float32_are_left_out_and_counted(tmp_path):
    columns = columns_of(x=columns_of()["x"].astype(np.float64))
    columns["x"][3] = 1e300  # numpy warns of such a cast
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns))
    scene = read(tmp_path / "a.ply")
    assert len(scene.gaussians) == 49
    assert scene.record.warnings == (
        "1 of 50 Gaussians have numbers that are not finite; they are left out.",
    )


@pytest.mark.parametrize("after", [b"\n", b"\r\n", b"\n" * 16])
@pytest.mark.parametrize("name", ["a.ply", "a.compressed.ply"])
def test_white_space_behind_the_last_row_is_no_damage(tmp_path, name, after):
    export(stripes(), tmp_path / name)
    before = read(tmp_path / name).gaussians
    content = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(content + after)
    assert same(read(tmp_path / name).gaussians, before)
    for bad in (b"\0", b"\n" * 17, b"\nx"):
        (tmp_path / name).write_bytes(content + bad)
        with pytest.raises(SceneFileError, match="damaged"):
            read(tmp_path / name)


def test_flat_gaussians_get_a_thin_third_axis(tmp_path):
    columns = columns_of()
    scene_of_three = gaussians_of(tmp_path, ply_bytes(columns))
    flat = gaussians_of(tmp_path, ply_bytes(without(columns, "scale_2")))
    assert torch.equal(flat.scales[:, :2], scene_of_three.scales[:, :2])
    assert torch.allclose(flat.scales[:, 2], torch.tensor(1e-6), rtol=1e-5)  # log and exp in float32
    assert torch.equal(flat.quats, scene_of_three.quats) and torch.equal(flat.means, scene_of_three.means)
    assert "flat (no scale_2)" in read(tmp_path / "a.ply").record.warnings[0]


def test_flat_gaussians_with_lengths_for_scales(tmp_path):
    columns = columns_of(**{f"scale_{axis}": np.full(50, 0.02, np.float32) for axis in range(2)})
    flat = gaussians_of(tmp_path, ply_bytes(without(columns, "scale_2")))
    assert torch.allclose(flat.scales, torch.tensor([0.02, 0.02, 1e-6]))


def test_one_scale_alone_is_refused(tmp_path):
    columns = without(columns_of(), "scale_1", "scale_2")
    assert "no scale_1, scale_2" in refusal(tmp_path, ply_bytes(columns))


@pytest.mark.parametrize("kind", ["bytes", "floats to 255", "floats to 1"])
def test_plain_colours_instead_of_harmonics(tmp_path, kind):
    rgb = np.random.default_rng(0).integers(0, 256, (50, 3)).astype(np.uint8)
    as_stored = {"bytes": rgb, "floats to 255": rgb.astype(np.float32), "floats to 1": rgb / np.float32(255)}
    plain = dict(zip(("red", "green", "blue"), as_stored[kind].T, strict=True))
    columns = without(columns_of(), "f_dc_0", "f_dc_1", "f_dc_2") | plain
    found = gaussians_of(tmp_path, ply_bytes(columns)).sh
    assert found.shape == (50, 1, 3)
    # float32 near 1 has 6e-8, which the division by SH_C0 makes 2e-7; twice rounded.
    assert np.allclose(0.5 + SH_C0 * found[:, 0].numpy(), rgb / 255, atol=5e-7)


@pytest.mark.parametrize(
    ("red", "word"),
    [
        (np.linspace(0, 300, 50, dtype=np.float32), "float32"),
        (np.linspace(-0.5, 1, 50, dtype=np.float32), "-0.5"),
        (np.linspace(0, 1.5, 50, dtype=np.float32), "1.5"),
        (np.arange(50, dtype=np.int16), "int16"),
    ],
)
def test_plain_colours_of_an_unknown_range_are_refused(tmp_path, red, word):
    columns = without(columns_of(), "f_dc_0", "f_dc_1", "f_dc_2")
    columns |= {"red": red, "green": red, "blue": red}
    assert word in refusal(tmp_path, ply_bytes(columns))


def test_harmonics_win_over_plain_colours_beside_them(tmp_path):
    columns = columns_of()
    both = columns | {name: np.zeros(50, np.uint8) for name in ("red", "green", "blue")}
    assert same(gaussians_of(tmp_path, ply_bytes(both)), gaussians_of(tmp_path, ply_bytes(columns)))


def test_a_shift_that_is_no_number_is_refused_in_scene_files(tmp_path):
    from langflash_core.scene.record import from_json, to_json

    assert from_json(to_json(stripes().with_record(shift=SURVEYED).record)).shift == SURVEYED
    for wrong in ([1.0, 2.0], [1.0, 2.0, "x"], [1.0, 2.0, float("nan")], [True, 1, 2], 7):
        with pytest.raises(ValueError, match="shift"):
            from_json({"shift": wrong})
