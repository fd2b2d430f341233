"""The library as it is used in a notebook: what a cell prints, what functions take, and what help() says."""

import importlib
import io
import pydoc
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from PIL import Image

import langflash_core as lf
from langflash_core.__main__ import NAME, find_program
from langflash_core.base.records import Guess, World
from langflash_core.base.request import ExportRequest
from langflash_core.errors import GraphicsError, SceneFileError, ViewError
from langflash_core.splat import render as reference
from langflash_core.types import Prediction, Scene, Views
from langflash_core.writing.renderers import TorchRenderer
from tests.blobs import three_blobs

LINE = 300  # characters: three lines of a wide terminal; the smallest tensor here prints 1,500
ROOT = Path(lf.__file__).parents[1]


@pytest.fixture(scope="module")
def room() -> Scene:
    return replace(three_blobs(), photos=(bytes(2_000),) * 2)


@pytest.fixture(scope="module")
def file(room, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("notebook") / "room.langflash"
    lf.save(room, path)
    return path


# What a cell prints


def test_a_scene_and_an_answer_are_three_lines(room):
    first, second, third = repr(room).splitlines()
    assert "240 Gaussians" in first and "2 views of 96 x 64" in first
    assert "'minilm' by 3 atoms" in second and "not known" in third
    world = World((1.0, 0, 0, 0), (0.0, 0, 0), guess=Guess(2.37, 1.8, 3.1, ("depth",)))
    assert "about 2.4 m per scene unit" in repr(room.with_record(world=world))
    assert "  3 m per scene unit" in repr(room.with_record(world=world, metric_scale=3.0))
    result = lf.query(room, ["couch", "elephant"], render=reference)
    first, second, third = repr(result).splitlines()
    assert "1 of 2 phrases" in first
    assert "  found: couch 1.00" in second and "not found: elephant 0." in third
    near = replace(result, answers=(result.answers[0], replace(result.answers[1], maybe=True)))
    assert "(maybe)" not in repr(result) and repr(near).endswith("(maybe)")
    assert all(len(line) < LINE / 3 for told in (room, result) for line in repr(told).splitlines())


def test_an_answer_to_many_phrases_is_three_lines(room):
    result = lf.query(room, [f"elephant {number}" for number in range(40)], render=reference)
    lines = repr(result).splitlines()
    assert len(lines) == 3 and "34 more" in lines[2]


def test_what_holds_arrays_prints_their_sizes(room):
    frame = reference(room, room.camera(0))
    views = Views(torch.zeros(2, 3, 64, 96), room.Ks, ("a.jpg", "b.jpg"), room.photos)
    weights, depths = torch.zeros(2, 3, 64, 96), torch.zeros(2, 64, 96)
    prediction = Prediction(
        room.gaussians, weights, room.semantics.dictionary, "minilm", room.viewmats, depths, depths
    )
    for told in (room.gaussians, room.semantics, frame, views, lf.segment(room, ["lamp"]), prediction):
        assert repr(told).startswith(f"{type(told).__name__}(")
        assert "\n" not in repr(told) and "tensor(" not in repr(told) and "\\x00" not in repr(told)
        assert len(repr(told)) < 3 * LINE  # a prediction holds Gaussians
    assert "rgb=float32 (64, 96, 3)" in repr(frame)


def test_an_inventory_is_three_lines(room):
    said = repr(lf.inventory(room)).splitlines()
    assert len(said) == 3 and " × " in said[1], "no plural is needed, nor made wrong"


# Masks


def test_a_mask_lies_on_its_answer(room):
    result = lf.query(room, ["couch", "elephant"], render=reference)
    couch, elephant = (each.mask for each in result.answers)
    assert couch is not None and elephant is not None
    assert couch.dtype == torch.bool and couch.shape == (64, 96)
    assert torch.equal(couch, result.masks[0]) and couch.any() and not elephant.any()
    assert "mask" not in repr(result.answers[0])


# Drawing


def test_a_view_is_drawn_and_shown(room):
    frame = lf.render(room, view=1, size=(48, 32))
    assert frame.rgb.shape == (32, 48, 3) and frame.weight_maps is None
    own = reference(room, room.camera(1, 48, 32), weight_maps=False)
    # OpenGL's colours and coverage have 8 and 16 bits; those of another view are off by up to 0.5.
    assert (frame.alphas - own.alphas).abs().max() < 0.05
    picture = Image.open(io.BytesIO(frame._repr_png_()))
    assert picture.size == (48, 32)
    with pytest.raises(ViewError, match="no view 2"):
        lf.render(room, view=2)


def test_a_photos_view_has_the_photos_size(room):
    stored = io.BytesIO()
    Image.new("RGB", (192, 128)).save(stored, "PNG")
    kept = replace(room, photos=(stored.getvalue(),) * 2)
    assert lf.render(kept, view=1, render=TorchRenderer()).rgb.shape == (128, 192, 3)
    assert lf.render(kept, camera=kept.camera(1), render=TorchRenderer()).rgb.shape == (64, 96, 3)


def test_a_renderer_that_is_given_draws(room):
    asked = []

    class Drawn(TorchRenderer):
        def __call__(self, scene, camera, *, weight_maps=True):
            asked.append((camera.width, weight_maps))
            return super().__call__(scene, camera, weight_maps=weight_maps)

    frame = lf.render(room, render=Drawn())
    assert asked == [(96, False)]
    assert torch.equal(frame.rgb, reference(room, room.camera(0)).rgb)


def test_opengl_draws_where_there_is_some_and_the_reference_elsewhere(room, monkeypatch, capsys):
    find_program()
    renderers = importlib.import_module(f"{NAME}.cli.renderers")

    class Hardware(TorchRenderer):
        backend = "gl"

        def release(self):
            pass

    monkeypatch.setattr(renderers, "GlRenderer", Hardware)
    with lf.renderer() as draw:
        assert draw.backend == "gl"

    def missing():
        raise GraphicsError("there is no OpenGL here; install a driver")

    monkeypatch.setattr(renderers, "GlRenderer", missing)
    with lf.renderer() as draw:
        assert draw.backend == "torch"
    assert "there is no OpenGL here" in capsys.readouterr().err


# Paths


def test_a_path_does_for_a_scene(room, file, tmp_path):
    """The file's numbers are halves, so scores are near those of the scene in memory, no more."""
    for given in (file, str(file)):
        answer = lf.query(given, "couch", render=reference).answers[0]
        assert answer.found and answer.score == pytest.approx(
            lf.query(room, "couch", render=reference).answers[0].score, abs=0.01
        )
    assert len(lf.select(file, "couch").gaussians) == len(lf.select(room, ["couch"]).gaussians)
    assert lf.segment(file, "couch").counts == lf.segment(room, ["couch"]).counts
    assert lf.inventory(file).counts == lf.inventory(room).counts
    assert lf.render(file, render=TorchRenderer()).rgb.shape == (64, 96, 3)
    lf.save(file, tmp_path / "room.ply")
    lf.write(file, ExportRequest(tmp_path / "couch.png", what="mask", prompts=("couch",), view=0))
    assert (tmp_path / "room.ply").is_file() and (tmp_path / "couch.png").is_file()


def test_a_file_that_is_not_there_is_one_sentence():
    for call in (lf.load, lambda path: lf.query(path, "couch"), lf.render, lf.inventory):
        with pytest.raises(SceneFileError, match=r"^scene nope does not exist; check the path$"):
            call("nope")
    with pytest.raises(SceneFileError, match="name a file ending in"):
        lf.load(__file__)  # is there, and no scene


def test_what_is_no_scene_is_told_in_a_sentence():
    """In a process of its own, where no types are checked at calls."""
    program = (
        "import langflash_core as lf\n"
        "calls = [lf.render, lf.inventory, lambda s: lf.query(s, 'x'), lambda s: lf.save(s, 'x.ply')]\n"
        "for call in calls:\n"
        "    try:\n"
        "        call(['a.jpg'])\n"
        "    except lf.LangFlashError as error:\n"
        "        print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], check=True, cwd=ROOT, capture_output=True, text=True
    )
    told = "this takes a scene or the path of one, not list"
    remedy = "make a scene with reconstruct, or read one with load"
    assert done.stdout.splitlines() == [f"{told}; {remedy}"] * 4


# Help


def test_inventory_is_a_function_however_its_package_was_read_in(room, monkeypatch):
    """Python gives its name in the library to the package as soon as that is read in."""
    importlib.import_module("langflash_core.inventory.plan")
    package = vars(lf)["inventory"]
    assert lf.inventory is package and lf.inventory(room).given.view_size == (96, 64)
    monkeypatch.delattr(lf, "inventory")  # as before
    assert lf.inventory is package


def test_help_reads_like_a_page():
    page = pydoc.plain(pydoc.render_doc(lf))
    start, rest = page.split("PACKAGE CONTENTS")
    for name in lf.__all__:
        assert f" {name}" in start, name
    functions = rest.split("FUNCTIONS")[1]
    for name in set(lf.__all__) - {"inventory"}:  # a package, which help() tells of by itself
        own = {"load": "read", "save": "export"}.get(name, name)
        assert f"\n    {name} = {own}(" in functions or f"\n    {own}(" in functions, name
    assert "__getattr__" not in page and "import_module" not in page and "wait_asleep" not in page
