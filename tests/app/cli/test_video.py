"""Films: their ways, their kinds, and what is wrong with key frames."""

import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from app.cli.renderers import GlRenderer
from langflash_core import pipeline
from langflash_core.errors import ViewError
from langflash_core.export.png import heat_over, to_8bit
from langflash_core.geometry.cameras import rotation_angle_degrees
from langflash_core.scene.file import load
from langflash_core.scene.tour import told_tour
from langflash_core.writing import films as video
from langflash_core.writing.renderers import TorchRenderer
from tests.app.cli.conftest import stripes
from tests.scene.test_tour import TOUR

K = [[35.0, 0.0, 28.0], [0.0, 35.0, 21.0], [0.0, 0.0, 1.0]]
TORCH = ("--backend", "torch")


def key(yaw: float, x: float, **more) -> dict:
    """A camera at x that looks to the right by `yaw`."""
    turn = np.eye(4)
    turn[0, 0] = turn[2, 2] = math.cos(yaw)
    turn[0, 2], turn[2, 0] = -math.sin(yaw), math.sin(yaw)
    turn[:3, 3] = -turn[:3, :3] @ [x, 0, 0]
    return {"viewmat": turn.tolist(), "K": K, "width": 56, "height": 42, **more}


def centre(camera) -> np.ndarray:
    viewmat = camera.viewmat.double().numpy()
    return -viewmat[:3, :3].T @ viewmat[:3, 3]


def written(tmp_path, entries):
    path = tmp_path / "keys.json"
    path.write_text(json.dumps(entries))
    return path


def test_key_frames_are_passed_at_their_times(tmp_path):
    entries = [key(0.0, 0.0, time=1.0), key(0.4, 0.3, time=2.0), key(-0.2, 0.1, time=3.5)]
    cameras = video.along(*video.read_key_frames(written(tmp_path, entries), None))
    assert len(cameras) == 2.5 * video.RATE + 1
    for entry, moment in zip(entries, (0.0, 1.0, 2.5), strict=True):
        there = cameras[round(moment * video.RATE)]
        torch.testing.assert_close(there.viewmat, torch.tensor(entry["viewmat"]), atol=1e-5, rtol=0)
        torch.testing.assert_close(there.K, torch.tensor(K))


def test_between_key_frames_nothing_jumps_and_poses_stay_rigid(tmp_path):
    entries = [key(0.0, 0.0), key(1.2, 0.4), key(0.3, -0.5), key(0.0, 0.0)]
    cameras = video.along(*video.read_key_frames(written(tmp_path, entries), 2.0))
    assert len(cameras) == 61
    turns = torch.stack([camera.viewmat[:3, :3].double() for camera in cameras])
    eye = torch.eye(3, dtype=torch.float64).expand_as(turns)
    torch.testing.assert_close(turns @ turns.mT, eye, atol=1e-6, rtol=0)
    angles = rotation_angle_degrees(turns[:-1], turns[1:]).numpy()
    steps = np.linalg.norm(np.diff([centre(camera) for camera in cameras], axis=0), axis=1)
    # Acceleration, not speed, is what a jump shows in: small beside the largest step.
    assert np.abs(np.diff(angles)).max() < 0.35 * angles.max()
    assert np.abs(np.diff(steps)).max() < 0.35 * steps.max()


@pytest.mark.parametrize(
    ("entries", "seconds", "hint"),
    [
        ([], None, "two or more cameras"),
        ({"a": 1}, None, "two or more cameras"),
        ([key(0, 0)], None, "two or more cameras"),
        ([key(0, 0), 3], None, "key frame 1 is not a camera"),
        ([key(0, 0), {**key(0, 0), "K": [[0]]}], None, "key frame 1 is not a camera"),
        ([key(0, 0), {"K": K}], None, "has no 'viewmat'"),
        ([key(0, 0, time=1), key(0, 1)], None, "times must rise"),
        ([key(0, 0, time=1), key(0, 1, time=1)], None, "times must rise"),
        ([key(0, 0, time=0), key(0, 1, time="2")], None, "times must rise"),
        ([key(0, 0, time=0), key(0, 1, time=1e9)], None, "at most 600 seconds"),
        ([key(0, 0, time=0), key(0, 1, time=2)], 3.0, "leave --seconds out"),
    ],
)
def test_bad_key_frames_are_one_sentence(tmp_path, entries, seconds, hint):
    with pytest.raises(ViewError, match=hint) as caught:
        video.read_key_frames(written(tmp_path, entries), seconds)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_no_json(tmp_path):
    path = tmp_path / "keys.json"
    path.write_bytes(b"\xff\xfe{")
    with pytest.raises(ViewError, match="no key frames"):
        video.read_key_frames(path, None)
    with pytest.raises(ViewError, match="there is no key frames"):
        video.read_key_frames(tmp_path / "gone.json", None)


def test_an_orbit_is_a_circle_that_looks_inwards():
    scene = stripes()
    cameras = video.way("orbit", scene, scene, (64, 48), 2.0)
    places = np.stack([centre(camera) for camera in cameras])
    forward = np.stack([camera.viewmat[2, :3].double().numpy() for camera in cameras])
    middle = np.array([0.0, 0.0, 1.0])  # of the wall
    away = np.linalg.norm(places - middle, axis=1)
    assert len(cameras) == 60 and away.std() < 1e-5 * away.mean() and np.ptp(places[:, 1]) < 1e-6
    looks = ((middle - places) * forward).sum(1) / away
    assert looks.min() > 0.999
    steps = np.linalg.norm(np.diff(np.concatenate((places, places[:1])), axis=0), axis=1)
    assert steps.std() < 1e-4 * steps.mean()  # it closes, at one speed


@pytest.mark.parametrize("path", [None, "orbit", "tour"])
def test_a_film_without_a_size_is_as_large_as_the_photos(path):
    stored = io.BytesIO()
    Image.new("RGB", (131, 98)).save(stored, "JPEG")
    scene = replace(stripes(), photos=(stored.getvalue(),) * 2).with_record(tour=told_tour(TOUR))
    (first, *_) = video.way(path, scene, scene, None, 0.1)
    assert (first.width, first.height) == (130, 98) != scene.view_size


def test_an_orbit_around_what_was_found(run, scene_file):
    scene = stripes()
    part = scene.rows(scene.gaussians.means[:, 0] < -0.3)
    (first, *_) = video.way("orbit", scene, part, (64, 48), 0.1)
    direction = np.array([-0.55, 0.0, 1.0]) - centre(first)
    forward = first.viewmat[2, :3].double().numpy()
    assert direction @ forward / np.linalg.norm(direction) > 0.999


@pytest.mark.parametrize("backend", [TorchRenderer, GlRenderer])
def test_a_heat_map_film_glows_where_the_phrase_is(backend):
    scene, renderer = stripes(), backend()
    heat = video.compile_phrase(scene, "armchair", None)
    picture = video.picture(scene, scene.camera(0), renderer, heat).astype(int)
    plain = video.picture(scene, scene.camera(0), renderer, None).astype(int)
    assert np.abs(picture - plain).max() > 30
    # The stripes are of one brightness; lit by the phrase one of them is not.
    assert picture[:, :15].mean() > 1.7 * picture[:, 30:].mean()
    assert plain[:, :15].mean() < 1.2 * plain[:, 30:].mean()
    if isinstance(renderer, GlRenderer):
        renderer.release()


@pytest.mark.parametrize("threshold", [None, 0.6])
def test_a_film_is_lit_from_where_the_mask_is(threshold):
    scene = stripes()
    heat = video.compile_phrase(scene, "armchair", threshold)
    found = pipeline.query(scene, "armchair", threshold=threshold)
    assert heat.lit_from(found.frame, found.relevance) == found.answers[0].lit_from
    lit = heat_over(found.relevance[0], found.frame.rgb, found.answers[0].lit_from, found.mode)
    picture = video.picture(scene, scene.camera(0), TorchRenderer(), heat)
    np.testing.assert_array_equal(picture, to_8bit(lit))


def test_a_film_is_lit_from_one_relevancy_in_all_frames(done, scene_file, tmp_path, monkeypatch):
    shown = []
    monkeypatch.setattr(video, "write", lambda path, *args: shown.append(args[4]) or path.write_bytes(b"-"))
    words = ("--what", "heat", "--prompt", "armchair", "--seconds", "0.4", *TORCH)
    done("export", scene_file, "-o", tmp_path / "a.webp", *words)
    done("export", scene_file, "-o", tmp_path / "b.webp", *words, "--threshold", "0.8")
    (answer,) = pipeline.query(load(scene_file), "armchair", render=TorchRenderer()).answers
    assert answer.lit_from > answer.threshold + 0.05
    assert shown[0].threshold == pytest.approx(answer.lit_from, abs=0.01) and shown[1].threshold == 0.8


def test_gl_reads_the_colours_that_the_frame_has():
    scene, renderer = stripes(), GlRenderer()
    camera = scene.camera(0, 64, 48)
    frame = to_8bit(renderer(scene, camera, weight_maps=False).rgb).astype(int)
    assert (
        np.abs(renderer.colours(scene, camera) - frame).max() <= 1
    )  # both round, one of float16 in a shader
    exact = TorchRenderer().colours(scene, camera).astype(int)
    assert np.abs(frame - exact).max() <= 2
    renderer.release()


def test_an_animated_webp(done, scene_file, tmp_path):
    pytest.importorskip("imageio_ffmpeg")
    words = ("--what", "heat", "--prompt", "armchair", "--seconds", "0.4", "--size", "65x49", *TORCH)
    outcome = done("export", scene_file, "-o", tmp_path / "a.webp", *words)
    assert "0.4 s, 64 x 48" in outcome.out
    with Image.open(tmp_path / "a.webp") as film:
        assert (film.n_frames, film.size, film.info["loop"]) == (12, (64, 48), 0)  # type: ignore[attr-defined]
        film.seek(6)
        assert np.asarray(film.convert("RGB"))[:, :15].mean() > 60


def test_a_film_along_key_frames(run, done, scene_file, tmp_path):
    film = pytest.importorskip("imageio_ffmpeg")
    keys = written(tmp_path, [key(0.0, 0.0), key(0.3, 0.2)])
    words = ("--path", keys, "--seconds", "0.5", *TORCH)
    done("export", scene_file, "-o", tmp_path / "a.mp4", *words)
    assert next(film.read_frames(str(tmp_path / "a.mp4")))["size"] == (56, 42)
    refused = run("export", scene_file, "-o", tmp_path / "b.mp4", "--path", tmp_path / "gone.json", *TORCH)
    assert refused.code == 2 and "gone.json" in refused.err and not (tmp_path / "b.mp4").exists()
