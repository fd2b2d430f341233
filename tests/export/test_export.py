"""Pictures and archives hold what was meant, read back by Pillow and NumPy; bad places are refused."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image

from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export import export, png, read
from langflash_core.export.answers import file_names, write_answers
from langflash_core.export.colours import heat, label_colours
from langflash_core.types import Camera, Frame, PromptAnswer, QueryResult

HEIGHT, WIDTH = 24, 32


@pytest.fixture
def result() -> QueryResult:
    ys, xs = torch.meshgrid(torch.linspace(0, 1, HEIGHT), torch.linspace(0, 1, WIDTH), indexing="ij")
    relevance = torch.stack((xs, ys, torch.full_like(xs, 0.3)))
    frame = Frame(torch.stack((xs, ys, xs * ys), -1) * 1.2, torch.ones(HEIGHT, WIDTH), 1 + xs)
    answers = tuple(
        PromptAnswer(prompt, found, 0.9, 0.6, 0.4, None, None)
        for prompt, found in (("red armchair", True), ("Tür / door", True), ("whale", False))
    )
    camera = Camera(torch.eye(4), torch.eye(3), WIDTH, HEIGHT)
    return QueryResult(answers, "relevancy", relevance, relevance > 0.6, frame, camera)


def opened(path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image)


def test_rgb_is_rounded_and_clamped(tmp_path):
    colours = torch.tensor([[[0.0, 0.5, 1.0], [-1.0, 2.0, torch.nan]]])
    png.write_rgb(tmp_path / "a.png", colours)
    assert opened(tmp_path / "a.png").tolist() == [[[0, 128, 255], [0, 255, 0]]]
    exact = torch.randint(0, 256, (5, 7, 3), dtype=torch.uint8)
    png.write_rgb(tmp_path / "b.png", exact)
    assert np.array_equal(opened(tmp_path / "b.png"), exact.numpy())


def test_masks_are_black_and_white(tmp_path):
    mask = torch.rand(9, 11) > 0.5
    png.write_mask(tmp_path / "m.png", mask)
    assert np.array_equal(opened(tmp_path / "m.png") == 255, mask.numpy())
    assert set(np.unique(opened(tmp_path / "m.png"))) <= {0, 255}


def test_relevance_can_be_read_back_to_half_a_step(tmp_path):
    values = torch.rand(13, 17) * 2 - 1
    values[0, 0] = torch.nan
    png.write_relevance(tmp_path / "r.png", values, "cosine")
    counts = opened(tmp_path / "r.png").astype(np.float64)
    assert opened(tmp_path / "r.png").dtype in (np.uint16, np.int32)  # Pillow may read 16 bits as 32
    back = counts / (2**16 - 1) * 2 - 1
    assert back[0, 0] == -1
    # Rounded to the nearest of 2^16 steps over a range of 2.
    assert np.abs(back - values.double().numpy())[1:].max() <= 1 / (2**16 - 1) + 1e-9


def test_heat_rises_in_brightness_and_takes_anything():
    luma = heat(torch.linspace(0, 1, 200)) @ torch.tensor([0.299, 0.587, 0.114])
    assert bool((luma.diff() > 0).all())
    assert bool(torch.isfinite(heat(torch.tensor([torch.nan, torch.inf, -5.0, 5.0]))).all())


@pytest.mark.parametrize(
    ("mode", "threshold"), [("relevancy", 0.6), ("relevancy", 0.5), ("cosine", 0.1), ("cosine", 0.4)]
)
def test_heat_over_a_view_glows_only_where_the_phrase_is(mode, threshold):
    low, high = png.RANGES[mode]
    view = torch.full((1, 3, 3), 0.5)
    relevance = torch.tensor([[low, threshold, high]])
    nothing, edge, full = png.heat_over(relevance, view, threshold, mode)[0]
    assert float(nothing.max() - nothing.min()) < 0.02  # grey
    assert float(nothing.mean()) < float(edge.mean()) <= float(full.mean())
    assert float(edge.max() - edge.min()) > 0.15  # coloured
    # The scale does not depend on what else is in the map.
    alone = png.heat_over(relevance[:, 1:2], view[:, 1:2], threshold, mode)
    assert torch.equal(alone[0, 0], edge)


def luminance(colour: torch.Tensor) -> float:
    """Relative luminance of an sRGB colour (3,), as WCAG 2 has it."""
    linear = torch.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    return float(linear @ torch.tensor([0.2126, 0.7152, 0.0722]))


@pytest.mark.parametrize("brightness", [0.0, 0.05, 0.1, 0.2])
def test_what_is_found_in_a_dark_room_is_seen(brightness):
    """In a room of this brightness heat was multiplied by it: 1.2 : 1 beside what is not found."""
    view = torch.full((1, 2, 3), brightness)
    nothing, thing = png.heat_over(torch.tensor([[0.0, 0.7]]), view, 0.6, "relevancy")[0]
    assert (luminance(thing) + 0.05) / (luminance(nothing) + 0.05) > 2.0


def test_labels_do_not_float_on_black(result):
    """A gap in the scene shows, dimmed, what is around it."""
    grey, alphas = torch.full((HEIGHT, WIDTH, 3), 0.8), torch.ones(HEIGHT, WIDTH)
    alphas[10:13, 5:8] = 0
    frame = replace(result.frame, rgb=grey * alphas[..., None], alphas=alphas)
    labels = png.label_picture(replace(result, frame=frame, masks=torch.zeros_like(result.masks)))
    np.testing.assert_allclose(labels, round(0.4 * 0.8 * 255), atol=1)


def test_labels_and_their_legend_agree(tmp_path, result):
    labels = png.label_map(result)
    assert labels[0, -1] == 1 and labels[-1, 0] == 2 and labels[0, 0] == 0
    png.write_labels(tmp_path / "labels.png", labels, ["chair", "door", "whale"])
    assert np.array_equal(opened(tmp_path / "labels.png"), labels.numpy())
    document = json.loads((tmp_path / "labels.json").read_text("utf-8"))
    legend = document["labels"]
    assert document["picture"] == "labels.png"  # whatever lies beside it, it says what it belongs to
    assert [entry["label"] for entry in legend] == ["", "chair", "door", "whale"]
    with Image.open(tmp_path / "labels.png") as image:
        shown = np.asarray(image.convert("RGB"))[0, WIDTH - 1]
    assert "#" + shown.tobytes().hex() == legend[1]["colour"]
    assert sum(entry["area"] for entry in legend) == pytest.approx(1)
    assert legend[3]["area"] == 0
    with pytest.raises(ValueError, match="labels"):
        png.write_labels(tmp_path / "x.png", labels + 5, ["chair"])


def test_label_colours_are_distinct():
    colours = label_colours(24).astype(int)
    gaps = np.abs(colours[:, None] - colours[None]).sum(-1) + 1000 * np.eye(24, dtype=int)
    assert gaps.min() > 30
    assert label_colours(0).shape == (0, 3)


def test_npz_has_the_documented_arrays(tmp_path, result):
    export(result, tmp_path / "query.npz")
    with np.load(tmp_path / "query.npz", allow_pickle=False) as arrays:
        shapes = {name: (arrays[name].shape, arrays[name].dtype) for name in arrays.files}
        assert shapes["relevance"] == ((3, HEIGHT, WIDTH), np.float32)
        assert shapes["mask"] == ((3, HEIGHT, WIDTH), np.bool_)
        assert shapes["depth"] == ((HEIGHT, WIDTH), np.float32)
        assert shapes["rgb"] == ((HEIGHT, WIDTH, 3), np.uint8)
        assert np.array_equal(arrays["relevance"], result.relevance.numpy())
        assert np.array_equal(arrays["mask"], result.masks.numpy())
        assert arrays["prompts"].tolist() == ["red armchair", "Tür / door", "whale"]


def test_the_folder_of_a_query(tmp_path, result):
    files = write_answers(result, tmp_path / "new" / "out", npz=True)
    assert len(files) == 3
    for entry in files:
        assert {"mask", "heat", "relevance", "rgb", "labels", "legend", "npz"} == set(entry)
        assert all(os.path.getsize(path) > 0 for path in entry.values())
    assert os.path.basename(files[1]["mask"]) == "tür_door_mask.png"
    assert np.array_equal(opened(files[0]["mask"]) > 0, result.masks[0].numpy())


def test_names_of_prompts_are_safe_and_distinct():
    names = file_names(["../../etc/passwd", "a b", "A  b!", "", "???", "дверь", "x" * 300, "ｄｏｏｒ"])
    assert names == ["etc_passwd", "a_b", "a_b_2", "prompt_3", "prompt_4", "дверь", "x" * 60, "door"]
    assert len(set(file_names(["door"] * 5))) == 5


def test_one_prompt_and_several_make_one_picture(tmp_path, result):
    export(result, tmp_path / "many.png")
    single = QueryResult(
        result.answers[:1], result.mode, result.relevance[:1], result.masks[:1], result.frame, result.camera
    )
    export(single, tmp_path / "one.png")
    export(result.frame, tmp_path / "frame.png")
    assert {opened(tmp_path / f"{name}.png").shape for name in ("many", "one", "frame")} == {
        (HEIGHT, WIDTH, 3)
    }


def test_places_and_suffixes_that_cannot_be(tmp_path, result):
    blocker = tmp_path / "file"
    blocker.write_bytes(b"in the way")
    for attempt, words in (
        (lambda: write_answers(result, blocker), "in the way"),
        (lambda: write_answers(result, blocker / "out"), "cannot create the folder"),
        (lambda: export(result, blocker / "a.npz"), "is a file"),
        (lambda: export(result, tmp_path / "nowhere" / "a.png"), "does not exist"),
        (lambda: export(result.frame, tmp_path), "suffix"),
        (lambda: export(result, tmp_path / "a.xyz"), r"use \.compressed\.ply, \.glb, \.html, \.json, "),
        (lambda: export(result, tmp_path / "a.langflash"), r"holds a scene; use \.glb, \.json, \.npz, \.png"),
    ):
        with pytest.raises(OutputError, match=words) as caught:
            attempt()
        assert "\n" not in str(caught.value) and ";" in str(caught.value)
    assert os.listdir(tmp_path) == ["file"] and blocker.read_bytes() == b"in the way"
    with pytest.raises(SceneFileError, match=r"scene.obj does not exist; check the path"):
        read(tmp_path / "scene.obj")
    with pytest.raises(SceneFileError, match=r"name a file ending in"):
        read(blocker)
