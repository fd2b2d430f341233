"""Marks and axes of splat files through the commands: what is said, what is kept, what is refused."""

from dataclasses import replace

import pytest
import torch

from langflash_core.export import export, read
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.file import load
from langflash_core.types import Gaussians
from tests.app.cli.conftest import stripes
from tests.export.splats import ply_bytes, stored_columns

SAID = "warning: The scene was made for smoothed splats, which are drawn as plain ones here."
HANGS = "warning: The scene seems to stand on its head"


@pytest.fixture
def mip_file(tmp_path):
    (tmp_path / "mip.ply").write_bytes(
        ply_bytes(stored_columns(), header="BEFORE comment SplatRenderMode: mip")
    )
    return tmp_path / "mip.ply"


def half_around(gaussians: Gaussians) -> Gaussians:
    """Turned by 180 degrees about x."""
    signs, turn = torch.tensor([1.0, -1, -1]), torch.tensor([1.0, 1, -1, -1])
    return replace(gaussians, means=gaussians.means * signs, quats=gaussians.quats * turn)


@pytest.fixture
def foreign_spz(tmp_path):
    """A .spz with the numbers of a PLY, which does not say so."""
    export(bare_scene(half_around(stripes().gaussians), "made"), tmp_path / "foreign.spz")
    return tmp_path / "foreign.spz"


def test_info_says_that_splats_are_antialiased(run, done, mip_file, scene_file):
    told = done("info", mip_file)
    assert SAID in told.err and "\nantialiased: yes\n" in told.out
    assert run("info", mip_file, "--json").json()["antialiased"] is True
    assert "antialiased" not in run("info", scene_file).out
    assert run("info", scene_file, "--json").json()["antialiased"] is False


def test_the_mark_outlives_an_edit(run, done, mip_file, tmp_path):
    done("clean", mip_file, "-o", tmp_path / "a.langflash", "--where", "opacity<.2")
    kept = load(tmp_path / "a.langflash")
    assert 0 < len(kept.gaussians) < 50 and kept.record.antialiased
    done("export", tmp_path / "a.langflash", "-o", tmp_path / "b.spz")
    assert SAID in run("info", tmp_path / "b.spz").err


@pytest.mark.parametrize("ending", [".splat", ".glb"])
def test_files_that_have_no_place_for_the_mark_are_said(run, mip_file, scene_file, tmp_path, ending):
    sentence = f"a {ending} cannot say that they are to be smoothed"
    assert sentence in run("export", mip_file, "-o", tmp_path / f"a{ending}").out
    assert sentence not in run("export", scene_file, "-o", tmp_path / f"b{ending}").out
    assert "smoothed" not in run("export", mip_file, "-o", tmp_path / "b.ply").out


def test_a_spz_of_supersplat_is_read_as_told(done, foreign_spz, tmp_path):
    guessed = done("export", foreign_spz, "-o", tmp_path / "a.ply")
    assert HANGS in guessed.err and "--axes rdf" in guessed.err
    told = done("export", foreign_spz, "-o", tmp_path / "b.ply", "--axes", "RDF")
    assert told.err == ""
    right = stripes().gaussians.means
    assert torch.allclose(read(tmp_path / "b.ply").gaussians.means, right, atol=1e-5)
    turned = half_around(stripes().gaussians).means
    assert torch.allclose(read(tmp_path / "a.ply").gaussians.means, turned, atol=1e-5)


def test_info_reads_the_axes_that_it_is_told(run, foreign_spz):
    boxes = [
        run("info", foreign_spz, "--json", *words).json()["bounding_box"] for words in ((), ("--axes", "rdf"))
    ]
    assert boxes[0]["max"][2] < 0 < boxes[1]["min"][2]


def test_a_spz_is_written_in_the_axes_that_are_told(run, done, scene_file, tmp_path):
    done("export", scene_file, "-o", tmp_path / "a.spz", "--axes", "rdf")
    done("export", scene_file, "-o", tmp_path / "b.spz")
    one, two = (read(tmp_path / name) for name in ("a.spz", "b.spz"))
    assert torch.allclose(one.gaussians.means, two.gaussians.means, atol=1e-5)
    named = run("info", tmp_path / "a.spz", "--axes", "rub")
    assert "The file names its own axes, rdf" in named.err
    assert "axes" not in run("info", tmp_path / "b.spz", "--axes", "rub").err


def test_axes_of_other_files_are_refused(refused, scene_file, mip_file, tmp_path):
    for words in (
        ("export", scene_file, "-o", tmp_path / "a.ply", "--axes", "rdf"),
        ("info", mip_file, "--axes", "rdf"),
        ("info", scene_file, "--axes", "rdf"),
        ("render", mip_file, "-o", tmp_path / "a.png", "--axes", "rdf"),
        ("info", mip_file, "--axes", "up"),
    ):
        assert "axes" in refused(*words)
