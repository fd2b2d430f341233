"""One known colour in every kind of file: the bytes are what the kind's own rules make of it.

Photos and scenes hold sRGB values. What others take for linear must be linear, or say that it is not.
"""

import gzip
import io
import json
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.export import export, glb, png, read, spz
from langflash_core.export.colours import label_colours
from langflash_core.geometry.fusion import Surface
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.scene.bare import bare_scene
from langflash_core.types import Frame, Scene
from langflash_core.writing.encoding import open_encoder
from tests.export.splats import glb_column, glb_parts, random_gaussians

SRGB = (200, 60, 30)  # of 255
LINEAR = (0.577580, 0.045186, 0.012983)  # IEC 61966-2-1 by hand: ((c + .055) / 1.055) ** 2.4
BASE = (np.array(SRGB) / 255 - 0.5) / SH_C0  # what trainers store


@pytest.fixture
def scene() -> Scene:
    """Eight Gaussians of the one colour, from everywhere."""
    gaussians = random_gaussians(8)
    sh = torch.tensor(BASE, dtype=torch.float32).expand(8, 1, 3).clone()
    return bare_scene(replace(gaussians, sh=sh), "made")


def first_numbers(kind: str, path: Path) -> tuple:
    """Position and colour of the one Gaussian of a file, in the numbers that its format stores."""
    content = path.read_bytes()
    if kind == ".ply":
        rows = np.frombuffer(content.split(b"end_header\n")[1], "<f4")
        return rows[:3], rows[6:9]  # behind positions and normals
    if kind == ".compressed.ply":
        chunk = np.frombuffer(content.split(b"end_header\n")[1], "<f4", 18)
        return chunk[:3], chunk[12:15]  # the least of its 256
    if kind == ".splat":
        return np.frombuffer(content, "<f4", 3), np.frombuffer(content, "u1")[24:27]
    if kind == ".spz":
        body = gzip.decompress(content)
        steps = [int.from_bytes(body[16 + 3 * a : 19 + 3 * a], "little", signed=True) for a in range(3)]
        return np.array(steps) / 2 ** body[13], np.frombuffer(body, "u1")[16 + 9 + 1 :][:3]
    if kind == ".sog":
        with zipfile.ZipFile(path) as archive:
            meta = json.loads(archive.read("meta.json"))
            places = np.asarray(Image.open(io.BytesIO(archive.read("sh0.webp"))).convert("RGBA"))
        lowest = np.array(meta["means"]["mins"])
        return np.sign(lowest) * np.expm1(abs(lowest)), np.array(meta["sh0"]["codebook"])[places[0, 0, :3]]
    if kind == ".glb":
        document, _ = glb_parts(path)
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        colour = attributes["KHR_gaussian_splatting:SH_DEGREE_0_COEF_0"]
        return document["accessors"][0]["min"], glb_column(path, colour, "<f4", 3)[0]
    numbers = (
        content.decode().split(f"{name} = [(")[1].split(")")[0].split(",")
        for name in ("positions", "sphericalHarmonicsCoefficients")
    )
    return tuple(np.array(some, float) for some in numbers)


@pytest.mark.parametrize(
    ("kind", "place", "colour", "within"),
    [
        (".ply", [1, 2, 3], BASE, 1e-6),
        (".compressed.ply", [1, 2, 3], np.array(SRGB) / 255, 1e-6),
        (".splat", [1, 2, 3], SRGB, 0),
        (".spz", [1, -2, -3], np.round((BASE * 0.15 + 0.5) * 255), 0),
        (".sog", [1, 2, 3], BASE, 1e-6),
        (".glb", [-1, -2, 3], BASE, 1e-6),
        (".usda", [1, -2, -3], BASE, 1e-5),  # seven digits of text
    ],
)
def test_axes_and_srgb_values_in_the_files_themselves(scene, tmp_path, kind, place, colour, within):
    """One to the right, two down, three ahead."""
    if kind == ".usda":
        pytest.importorskip("pxr")
    one = scene.gaussians.rows(torch.tensor([0]))
    one = bare_scene(replace(one, means=torch.tensor([[1.0, 2.0, 3.0]])), "made")
    path = tmp_path / f"a{kind}"
    spz.write_spz(one, path, version=3) if kind == ".spz" else export(one, path)
    found = first_numbers(kind, path)
    np.testing.assert_allclose(found[0], place, atol=1e-4)
    assert np.abs(found[1] - colour).max() <= within
    shown = 0.5 + SH_C0 * read(path).gaussians.sh[:, 0].numpy()
    assert np.abs(shown - np.array(SRGB) / 255).max() < 1.5 / 255


def test_a_stage_says_srgb_in_a_word_that_openusd_knows(scene, tmp_path):
    Usd = pytest.importorskip("pxr.Usd")
    export(scene, tmp_path / "a.usdc")
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    harmonics = stage.GetDefaultPrim().GetAttribute("radiance:sphericalHarmonicsCoefficients")
    assert Usd.ColorSpaceAPI.ComputeColorSpaceName(harmonics, None) == "srgb_rec709_scene"


@pytest.mark.parametrize("where", ["prim", "parent", "attribute"])
def test_linear_stages_become_srgb(scene, tmp_path, where):
    """A space is said by a prim, by one above it, or by the numbers themselves."""
    Usd = pytest.importorskip("pxr.Usd")
    linear_base = (np.array(LINEAR) - 0.5) / SH_C0
    sh = torch.tensor(linear_base, dtype=torch.float32).expand(8, 1, 3).clone()
    export(replace(scene, gaussians=replace(scene.gaussians, sh=sh)), tmp_path / "a.usda")
    text = (tmp_path / "a.usda").read_text()
    said = 'uniform token colorSpace:name = "lin_rec709_scene"'
    plain = text.replace('uniform token colorSpace:name = "srgb_rec709_scene"', "")
    start = plain.index("def ParticleField")
    (tmp_path / "b.usda").write_text(
        {
            "prim": text.replace("srgb_rec709_scene", "lin_rec709_scene"),
            "parent": f'{plain[:start]}def Xform "Room" (\nprepend apiSchemas = ["ColorSpaceAPI"]\n)'
            f"{{\n{said}\n{plain[start:]}}}\n".replace('defaultPrim = "Splats"', 'defaultPrim = "Room"'),
            "attribute": plain,
        }[where]
    )
    if where == "attribute":
        stage = Usd.Stage.Open(str(tmp_path / "b.usda"))
        harmonics = stage.GetDefaultPrim().GetAttribute("radiance:sphericalHarmonicsCoefficients")
        harmonics.SetColorSpace("lin_rec709_scene")
        stage.Save()
        del stage
    found = read(tmp_path / "b.usda")
    shown = 0.5 + SH_C0 * found.gaussians.sh[:, 0].numpy()
    assert (
        np.abs(shown - np.array(SRGB) / 255).max() < 1e-4
    )  # LINEAR has six digits, a slope of at most 12.92
    assert any("linear colours" in sentence for sentence in found.record.warnings)


def test_a_colour_space_that_is_not_known_is_said(scene, tmp_path):
    pytest.importorskip("pxr")
    export(scene, tmp_path / "a.usda")
    text = (tmp_path / "a.usda").read_text()
    (tmp_path / "a.usda").write_text(text.replace("srgb_rec709_scene", "lin_ap1_scene"))
    assert any("'lin_ap1_scene'" in sentence for sentence in read(tmp_path / "a.usda").record.warnings)


def test_a_surface_is_linear_in_16_bits_and_no_metal(tmp_path):
    """Of 8 bits, 30 of 255 would be 3 of 255: a sixth off."""
    corners = np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]])
    colours = np.array([SRGB, (0, 0, 0), (255, 255, 255)], np.uint8)
    glb.write_surfaces([("wall", Surface(corners, np.array([[0, 2, 1]]), colours))], tmp_path / "a.glb")
    document, _ = glb_parts(tmp_path / "a.glb")
    (primitive,) = document["meshes"][0]["primitives"]
    described = document["accessors"][primitive["attributes"]["COLOR_0"]]
    assert described["componentType"] == 5123 and described["normalized"] is True
    stored = glb_column(tmp_path / "a.glb", primitive["attributes"]["COLOR_0"], "<u2", 4)
    assert np.abs(stored[0, :3] / 65535 - LINEAR).max() < 1e-5
    assert stored[1].tolist() == [0, 0, 0, 65535] and stored[2].tolist() == [65535] * 4
    material = document["materials"][primitive["material"]]
    assert material["doubleSided"] is True
    assert material["pbrMetallicRoughness"] == {"metallicFactor": 0.0, "roughnessFactor": 1.0}


def test_boxes_have_the_colours_of_their_labels(tmp_path):
    """A factor of a material is linear; the same label in a picture is sRGB."""
    box = {"center": [0, 0, 1], "axes": np.eye(3).tolist(), "size": [1, 1, 1]}
    glb.write_boxes([("chair", box), ("lamp", box)], tmp_path / "a.glb")
    document, _ = glb_parts(tmp_path / "a.glb")
    for material, colour in zip(document["materials"], label_colours(2), strict=True):
        factor = material["pbrMetallicRoughness"]["baseColorFactor"]
        shown = [1.055 * part ** (1 / 2.4) - 0.055 for part in factor[:3]]
        np.testing.assert_allclose(255 * np.array(shown), colour, atol=1e-6)
        assert factor[3] == 0.35 and material["pbrMetallicRoughness"]["metallicFactor"] == 0


def test_pictures_are_srgb(tmp_path):
    pixels = (torch.tensor(SRGB) / 255).expand(2, 2, 3)
    png.write_frame(Frame(pixels, torch.ones(2, 2), torch.ones(2, 2), None), tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.getpixel((0, 0)) == SRGB
        assert not {"gamma", "icc_profile", "chromaticity"} & set(picture.info)  # unsaid is sRGB


@pytest.mark.parametrize("size", [(640, 360), (1280, 720)])
def test_films_say_their_matrix(tmp_path, size):
    """Brightness is that of BT.709, and the file says so, whatever its size: what is unsaid is guessed."""
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    with open_encoder(tmp_path / "a.mp4", size) as write:
        write(bytes(SRGB) * size[0] * size[1])
    program = imageio_ffmpeg.get_ffmpeg_exe()
    said = subprocess.run([program, "-i", tmp_path / "a.mp4"], capture_output=True, text=True).stderr
    assert "bt709/bt709/iec61966-2-1" in said
    words = ("-v", "error", "-i", tmp_path / "a.mp4", "-f", "rawvideo", "-pix_fmt", "yuv420p", "-")
    plane = np.frombuffer(subprocess.run([program, *words], capture_output=True).stdout, "u1")
    luma = 16 + 219 / 255 * np.dot((0.2126, 0.7152, 0.0722), SRGB)  # 91.0; of BT.601 it would be 100
    assert abs(float(plane[: size[0] * size[1]].mean()) - luma) < 2  # rounding, and what the encoder loses
