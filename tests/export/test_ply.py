"""3DGS PLY: written as others read it, read as others write it, refused where it is damaged."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh

from langflash_core.base.files import write_atomically
from langflash_core.export import export, read
from langflash_core.export.settings import STORED
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.checks import check_scene
from tests.export.splats import ply_bytes, random_gaussians, same, stored_columns


def written(tmp_path, gaussians):
    export(bare_scene(gaussians, "made"), tmp_path / "a.ply")
    return tmp_path / "a.ply"


def test_another_reader_finds_what_the_convention_says(tmp_path):
    """trimesh reads PLY with a parser of its own."""
    made = random_gaussians(40, degree=2)
    loaded = trimesh.load(written(tmp_path, made), file_type="ply")
    vertex = loaded.metadata["_ply_raw"]["vertex"]
    rows = vertex["data"]
    names = list(vertex["properties"])
    assert names[:9] == ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"]
    assert names[9:33] == [f"f_rest_{index}" for index in range(24)]
    assert names[33:] == ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]
    for basis in range(1, 9):
        for colour in range(3):
            column = rows[f"f_rest_{8 * colour + basis - 1}"].ravel()
            assert np.array_equal(column, made.sh[:, basis, colour].numpy())
    assert np.array_equal(rows["y"].ravel(), made.means[:, 1].numpy())
    assert np.allclose(np.exp(rows["scale_2"].ravel()), made.scales[:, 2].numpy(), rtol=2e-6)
    opacities = 1 / (1 + np.exp(-rows["opacity"].ravel().astype(float)))
    assert np.allclose(opacities, made.opacities.numpy(), atol=3e-7)
    assert all(np.isfinite(rows[name]).all() for name in names)  # opacity 0 and 1 among them


def test_degree_four_is_read_whole_and_written_to_degree_three(tmp_path):
    columns = stored_columns()
    columns |= {f"f_rest_{index}": np.full(50, index, np.float32) for index in range(72)}
    (tmp_path / "four.ply").write_bytes(ply_bytes(columns))
    scene = read(tmp_path / "four.ply")
    assert scene.gaussians.sh.shape == (50, 25, 3)
    assert scene.gaussians.sh[0, 24].tolist() == [23, 47, 71]  # the last basis of each colour
    export(scene, tmp_path / "three.ply")
    assert torch.equal(read(tmp_path / "three.ply").gaussians.sh, scene.gaussians.sh[:, :16])


@pytest.mark.parametrize("order", ["<", ">"])
def test_order_types_and_strangers_do_not_matter(tmp_path, order):
    columns = stored_columns()
    expected = ply_bytes(columns)
    (tmp_path / "plain.ply").write_bytes(expected)
    mixed = dict(reversed(columns.items()))
    mixed["x"] = mixed["x"].astype(np.float64)
    mixed = {"red": np.arange(50, dtype=np.uint8), **mixed, "label": np.arange(50, dtype=np.int16)}
    header = (
        "BEFORE element camera 2\nBEFORE property double focal\n"
        "comment a stranger\nelement face 3\nproperty list uchar int vertex_indices"
    )
    after = b"\x01\x00\x00\x00\x00" * 3
    (tmp_path / "mixed.ply").write_bytes(
        ply_bytes(mixed, order, before=bytes(16), after=after, header=header)
    )
    plain, strange = read(tmp_path / "plain.ply").gaussians, read(tmp_path / "mixed.ply").gaussians
    assert same(plain, strange)
    assert torch.allclose(plain.scales[:, 1], torch.from_numpy(columns["scale_1"]).exp())
    assert torch.allclose(plain.opacities, torch.from_numpy(columns["opacity"]).sigmoid())


def test_lines_may_end_as_on_windows(tmp_path):
    content = ply_bytes(stored_columns())
    body = content.index(b"end_header\n") + 11
    (tmp_path / "a.ply").write_bytes(content[:body].replace(b"\n", b"\r\n") + content[body:])
    assert len(read(tmp_path / "a.ply").gaussians) == 50


def test_opacities_and_scales_that_are_activated_are_taken_as_they_are(tmp_path):
    columns = stored_columns()
    columns["opacity"] = np.linspace(0, 1, 50, dtype=np.float32)
    columns |= {f"scale_{axis}": np.exp(columns[f"scale_{axis}"]) for axis in range(3)}
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns))
    scene = read(tmp_path / "a.ply")
    assert np.array_equal(scene.gaussians.opacities.numpy(), columns["opacity"])
    assert np.allclose(scene.gaussians.scales[:, 0].numpy(), columns["scale_0"])
    assert ["opacities" in said for said in scene.record.warnings] == [True, False]


def test_a_scene_in_millimetres_is_not_taken_for_one_with_linear_scales(tmp_path):
    columns = stored_columns()
    for axis, name in enumerate("xyz"):
        columns[name] *= 3000  # a room
        columns[f"scale_{axis}"] += 10  # some 150 mm: all logarithms above 0
    assert min(columns[f"scale_{axis}"].min() for axis in range(3)) > 0
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns))
    assert read(tmp_path / "a.ply").record.warnings == ()


def test_own_files_leave_nothing_to_guess(tmp_path):
    """Logits from 0 to 1 and huge scales, which would be taken for activated ones from elsewhere."""
    made = random_gaussians(30)
    made.opacities[:] = torch.linspace(0.5, 0.73, 30)
    made.scales[:] = 5.0
    after = read(written(tmp_path, made))
    assert torch.allclose(after.gaussians.opacities, made.opacities, atol=3e-7)
    assert torch.allclose(after.gaussians.scales, made.scales, rtol=2e-6)
    assert after.record.warnings == ()


def test_what_is_not_finite_is_left_out_and_counted(tmp_path):
    columns = stored_columns()
    columns["x"][3], columns["rot_2"][4], columns["scale_0"][5] = np.nan, np.inf, np.nan
    columns["f_dc_1"][6], columns["opacity"][7] = -np.inf, np.nan
    columns["opacity"][8], columns["scale_1"][9] = np.inf, -np.inf  # opaque, and flat: both mean something
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns))
    scene = read(tmp_path / "a.ply")
    check_scene(scene)
    assert len(scene.gaussians) == 45
    assert scene.record.warnings == (
        "5 of 50 Gaussians have numbers that are not finite; they are left out.",
    )
    assert scene.gaussians.opacities[3] == 1  # row 8, after five others went


def test_quaternions_of_any_length_become_unit(tmp_path):
    columns = stored_columns()
    for axis in range(4):
        columns[f"rot_{axis}"] *= 100
        columns[f"rot_{axis}"][0] = 0
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns))
    quats = read(tmp_path / "a.ply").gaussians.quats
    assert quats[0].tolist() == [1, 0, 0, 0]
    assert torch.allclose(quats.norm(dim=-1), torch.ones(50))


def test_more_rows_than_are_read_at_once(tmp_path, monkeypatch):
    whole = read(written(tmp_path, random_gaussians(1000, 1))).gaussians
    for module in ("ply", "stored"):
        monkeypatch.setattr(f"langflash_core.export.{module}.STORED", replace(STORED, rows_at_once=64))
    in_parts = read(written(tmp_path, random_gaussians(1000, 1))).gaussians
    assert same(whole, in_parts)


def test_what_stops_the_writing_leaves_the_old_file(tmp_path):
    def parts():
        yield b"half"
        raise KeyboardInterrupt

    (tmp_path / "a.ply").write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt):
        write_atomically(tmp_path / "a.ply", parts())
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a.ply", b"old")]
