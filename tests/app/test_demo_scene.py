"""The whole path with the shipped weights on shipped photos, as a user walks it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

import langflash_core as lf
from app.gl import SplatRenderer, offscreen_context
from langflash_core.base.resources import asset_path
from langflash_core.language.relevance import compile_query, relevance_maps
from langflash_core.language.spaces import language_space
from langflash_core.splat import render
from langflash_core.types import Scene

pytestmark = pytest.mark.slow

PROMPTS = ("floor", "wall", "window", "plant", "chair", "piano")
MAX_MEMORY_KB = 2_500_000


@pytest.fixture(scope="module")
def room() -> Scene:
    return lf.reconstruct([asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")])


def test_gl_and_torch_agree_on_the_trained_scene(room):
    """45 dB and a mean of 0.005: float16 targets add 2^-11 per blended layer, some tens of layers."""
    camera = room.camera(0)
    truth = render(room, camera)
    assert truth.weight_maps is not None
    compiled = compile_query(room.semantics, language_space(room.semantics.space), PROMPTS)
    expected = relevance_maps(truth.weight_maps, compiled)
    context = offscreen_context()
    renderer = SplatRenderer(context)
    try:
        renderer.set_scene(room)
        renderer.ask(compiled)
        renderer.draw(camera)
        drawn, relevance = renderer.frame(), renderer.relevance()
        passes = dict(renderer.passes)
        renderer.ask(compile_query(room.semantics, language_space(room.semantics.space), ["sofa"]))
        renderer.relevance()
        assert renderer.passes["colour"] == passes["colour"]  # a new phrase draws no splat
        assert renderer.passes["weights"] == passes["weights"]
        assert context.error == "GL_NO_ERROR"
    finally:
        renderer.release()
        context.release()
    error = torch.mean((drawn.rgb.double().clamp(0, 1) - truth.rgb.double().clamp(0, 1)) ** 2)
    assert -10 * torch.log10(error) >= 45
    covered = truth.alphas > 0.5
    assert (relevance.double() - expected.double()).abs()[:, covered].mean() <= 0.005


def test_the_demo_room_has_a_floor_below_its_walls_and_no_piano(room):
    result = lf.query(room, ["floor", "wall", "piano"], view=0)
    floor, wall, piano = result.answers
    assert floor.found and wall.found and not piano.found
    assert floor.centroid is not None and wall.centroid is not None
    assert floor.centroid[1] > wall.centroid[1]  # +y is down
    rows = torch.arange(result.masks.shape[1])[:, None].expand(result.masks.shape[1:])
    assert rows[result.masks[0]].float().median() > 0.6 * result.masks.shape[1]


# A child's peak counts what its parent held when it forked, and this process may hold gigabytes by now: a
# small process in between starts the program and says its peak in the last line of stderr.
_BETWEEN = """
import resource, subprocess, sys
code = subprocess.call(sys.argv[1:])
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, file=sys.stderr)
sys.exit(code)
"""


def _langflash(*words: object) -> subprocess.CompletedProcess:
    command = [sys.executable, "-c", _BETWEEN, sys.executable, "-m", "langflash_core", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert int(done.stderr.splitlines()[-1]) < MAX_MEMORY_KB
    return done


def test_reconstruct_then_query_from_the_command_line(tmp_path):
    photos = [asset_path(f"photos/books_{side}.jpg") for side in ("left", "right")]
    scene, out = tmp_path / "s.langflash", tmp_path / "out"
    done = _langflash("reconstruct", *photos, "-o", scene, "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["views"] == 2 and report["gaussians"] > 10_000 and report["atoms"] >= 1
    done = _langflash("query", scene, "book", "floor", "--view", 1, "-o", out, "--json", "--npz")
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout)["prompts"]
    assert [answer["prompt"] for answer in answers] == ["book", "floor"]
    for answer in answers:
        assert all(Path(path).is_file() for path in answer["files"].values())
    (archive,) = out.glob("*.npz")
    with np.load(archive) as arrays:
        height, width = arrays["depth"].shape
        assert arrays["relevance"].shape == arrays["mask"].shape == (2, height, width)
        assert arrays["rgb"].shape == (height, width, 3)
        assert np.isfinite(arrays["relevance"]).all()
