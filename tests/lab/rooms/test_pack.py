"""Catalogues and meshes: parsing, posing, decimation, the pack file."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from langflash_core.errors import InputError
from langflash_core.lab.rooms import Pack, build_pack, load_catalogue, load_pack
from langflash_core.lab.rooms.catalogue import clean_name, parse_properties
from langflash_core.lab.rooms.mesh import height_map, index, pose
from langflash_core.lab.rooms.objfile import Soup, parse_mtl, parse_obj, smooth_normals

CUBE = """mtllib cube.mtl
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
usemtl wood
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf -5 -6 -2 -1
usemtl steel
f 1 5 8 4\nf 2 3 7 6
"""
ENTRY = """id#1=Blend Swap CC-0#cube\nname#1=Oak chair\ntags#1=Blend Swap, Seat, Thonet
category#1=Living room\nmodel#1=/m/cube.obj\nwidth#1=50\ndepth#1=40\nheight#1=90\ncreator#1=Nobody
id#2=Blend Swap CC-0#car\nname#2=Truck\ncategory#2=Vehicles
model#2=/m/car.obj\nwidth#2=9\ndepth#2=9\nheight#2=9
"""


@pytest.fixture
def library(tmp_path: Path) -> Path:
    with zipfile.ZipFile(tmp_path / "BlendSwap-CC-0.sh3f", "w") as archive:
        archive.writestr("PluginFurnitureCatalog.properties", ENTRY)
        archive.writestr("m/cube.obj", CUBE)
        archive.writestr(
            "m/Cube.mtl", "newmtl wood\nKd 0.5 0.25 0.1\nd 0.5\nnewmtl steel\nKd 0.1 0.2 0.3\nKs 1 1 1\n"
        )
    return tmp_path


def test_properties_unescape() -> None:
    assert parse_properties("# c\na = 1\nb=H\\u00f4i \\\n  An\n") == {"a": "1", "b": "Hôi An"}


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("Bed 140x190", "double bed"),
        ("Socket", "sock"),
        ("Sofa", "sofa"),
        ("Double window 3 panes", "double window panes"),
    ],
)
def test_names_become_plain_words(name: str, plain: str) -> None:
    assert clean_name(name) == plain


def test_catalogue_keeps_what_belongs_indoors(library: Path) -> None:
    (item,) = load_catalogue(library).items
    assert item.names == ("oak chair", "thonet", "chair")
    assert item.size == pytest.approx((0.5, 0.9, 0.4))
    assert item.surface == pytest.approx(0.9) and not item.opening


def test_empty_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="root"):
        load_catalogue(tmp_path)


def test_pack_round_trip(library: Path, tmp_path: Path) -> None:
    out = tmp_path / "pack.npz"
    count = build_pack(library, out, copies=0.0)  # one make of each kind
    pack = load_pack(out)
    assert len(pack.items) == count
    number = next(i for i, item in enumerate(pack.items) if item.name == "oak chair")
    first, many = pack.vertex_ranges[number]
    points = pack.positions[first : first + many]
    np.testing.assert_allclose(points.min(0), [-0.25, 0.0, -0.2], atol=1e-4)
    np.testing.assert_allclose(points.max(0), [0.25, 0.9, 0.2], atol=1e-4)
    assert pack.face_ranges[number][1] == 12
    colours = {
        tuple(np.round(c.astype(float), 3).tolist())
        for c in pack.material_table[pack.material_ids[first : first + many], 0]
    }
    assert colours == {(0.5, 0.25, 0.1, 0.5), (0.1, 0.2, 0.3, 1.0)}
    normals = pack.normals[first : first + many]
    assert np.abs(normals).max(1).min() > 0.99  # hard edges stay hard
    assert out.read_bytes() == out.read_bytes() and not list(tmp_path.glob(".pack*"))


def test_foreign_and_missing_packs_are_refused(library: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.npz"
    bad.write_bytes(b"not a pack")
    whole = tmp_path / "pack.npz"
    build_pack(library, whole, keys=frozenset())
    data = whole.read_bytes()
    half, spoilt = tmp_path / "half.npz", tmp_path / "spoilt.npz"
    half.write_bytes(data[: len(data) // 2])
    spoilt.write_bytes(data[: len(data) // 2] + bytes(64) + data[len(data) // 2 + 64 :])
    for path in (bad, half, spoilt, tmp_path / "none.npz"):
        with pytest.raises(InputError, match="langflash lab rooms pack"):
            load_pack(path)


def test_obj_polygons_and_negative_indices() -> None:
    soup, libraries = parse_obj(CUBE)
    assert libraries == ("cube.mtl",) and soup.material_names == ("wood", "steel")
    assert soup.positions.shape == (12, 3, 3)
    areas = np.linalg.norm(
        np.cross(soup.positions[:, 1] - soup.positions[:, 0], soup.positions[:, 2] - soup.positions[:, 0]),
        axis=1,
    )
    assert areas.sum() / 2 == pytest.approx(6.0)
    with pytest.raises(ValueError, match="faces"):
        parse_obj("v 0 0 0\n")


def test_window_panes_are_marked() -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl grey\nf 1 2 3\n"
    text += "g sweethome3d_window_pane_1\nf 1 2 3\ng frame\nf 1 2 3\n"
    soup, _ = parse_obj(text)
    assert soup.material_names == ("grey", "grey (pane)")
    assert soup.materials.tolist() == [0, 1, 0]


def test_mtl_texture_names() -> None:
    look = parse_mtl("newmtl a\nKd 0 0 0\nmap_Kd C:\\x\\wood.jpg\n")["a"]
    assert look.texture == "wood.jpg" and look.opacity == 1.0


def test_pose_rotates_before_it_scales() -> None:
    soup, _ = parse_obj(CUBE)
    quarter = (0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 0.0)
    posed = pose(soup, (2.0, 1.0, 3.0), quarter)
    np.testing.assert_allclose(np.ptp(posed.positions.reshape(-1, 3), axis=0), [2.0, 1.0, 3.0])
    np.testing.assert_allclose(np.linalg.norm(posed.normals, axis=-1), 1.0)


def test_normals_smooth_only_below_the_crease() -> None:
    soup, _ = parse_obj(CUBE)
    assert np.abs(np.abs(smooth_normals(soup.positions)).max(-1) - 1).max() < 1e-9
    rounded = smooth_normals(soup.positions, crease_cos=-1.1)
    assert np.abs(rounded).max() < 0.95


def test_decimation_keeps_size_and_surface() -> None:
    grid = np.linspace(-1, 1, 61)
    x, z = np.meshgrid(grid, grid)
    sheet = np.stack([x, 0.2 * np.cos(3 * x) * np.cos(2 * z), z], axis=-1)
    a, b, c, d = sheet[:-1, :-1], sheet[:-1, 1:], sheet[1:, 1:], sheet[1:, :-1]
    triangles = np.concatenate(
        [np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)]
    )
    soup = Soup(
        triangles,
        smooth_normals(triangles),
        np.zeros((len(triangles), 3, 2)),
        np.zeros(len(triangles), int),
        ("",),
    )
    mesh = index(soup, 2_000)
    assert 500 < len(mesh.faces) <= 2_000
    assert np.ptp(mesh.positions, axis=0) == pytest.approx(np.ptp(triangles.reshape(-1, 3), axis=0), abs=0.08)
    height = 0.2 * np.cos(3 * mesh.positions[:, 0]) * np.cos(2 * mesh.positions[:, 2])
    assert np.abs(height - mesh.positions[:, 1]).max() < 0.05  # a cell is 1/30 of the sheet


def test_height_map_finds_the_top() -> None:
    soup, _ = parse_obj(CUBE)
    heights = height_map(pose(soup, (1.0, 0.7, 1.0), tuple(np.eye(3).ravel())).positions, (1.0, 0.7, 1.0))
    assert heights.min() == pytest.approx(0.7)


def test_tiny_pack_is_public_domain(pack: Pack) -> None:
    assert {item.library for item in pack.items} == {"BlendSwap-CC-0", "builtin"}
    assert len({item.group for item in pack.items}) > 20
