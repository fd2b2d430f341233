import math
from dataclasses import replace

import pytest
import torch

from langflash_core.errors import PromptError
from langflash_core.geometry.cameras import pixel_grid
from langflash_core.geometry.quaternions import quats_to_matrices
from langflash_core.language.answers import (
    answer,
    oriented_box,
    presence_scores,
    weighted_centroid,
    world_points,
)
from langflash_core.language.relevance import CompiledQuery, Mode
from langflash_core.types import Camera, Frame

WIDTH, HEIGHT = 80, 60


def query(*texts, mode: Mode = "relevancy", threshold=0.5, num_atoms=2):
    empty = torch.zeros(0, 2)
    prompts = torch.zeros(len(texts), 2)
    return CompiledQuery(torch.zeros(num_atoms, 2), prompts, empty, 10.0, threshold, mode, texts)


def camera(viewmat=None):
    K = torch.tensor([[70.0, 0, 40], [0, 70.0, 30], [0, 0, 1]])
    return Camera(torch.eye(4) if viewmat is None else viewmat, K, WIDTH, HEIGHT)


def frame(depth=2.0, alpha=1.0):
    depths = torch.full((HEIGHT, WIDTH), depth)
    return Frame(torch.zeros(HEIGHT, WIDTH, 3), torch.full((HEIGHT, WIDTH), alpha), depths)


def blob(rows, columns, inside=0.9, outside=0.2):
    relevance = torch.full((HEIGHT, WIDTH), outside)
    relevance[rows, columns] = inside
    return relevance


def test_a_present_phrase():
    relevance = blob(slice(10, 30), slice(50, 70))[None]
    result = answer(relevance, frame(), camera(), query("lamp"))
    (found,) = result.answers
    assert found.found
    assert found.score == pytest.approx(0.9, abs=1e-6)
    assert found.area == pytest.approx(400 / 4800)
    assert result.masks.sum() == 400
    assert result.masks[0, 10:30, 50:70].all()
    # The middle of columns 50..70 and rows 10..30 at depth 2: ((60 - 40) / 70 * 2, ...).
    assert found.centroid == pytest.approx((40 / 70, -20 / 70, 2.0), abs=1e-5)
    assert found.box is not None
    # 20 pixels at 2 / 70 each, less 2 % at both ends; the plane has no thickness.
    assert found.box["size"] == pytest.approx([0.96 * 19 * 2 / 70] * 2 + [0], abs=0.03)


def test_an_absent_phrase_is_not_the_least_bad_pixel():
    relevance = blob(slice(0, 20), slice(0, 20), inside=0.45)[None]
    result = answer(relevance, frame(), camera(), query("elephant"))
    (absent,) = result.answers
    assert not absent.found
    assert absent.score == pytest.approx(0.45, abs=1e-6)
    assert (absent.area, absent.centroid, absent.box) == (0.0, None, None)
    assert not result.masks.any()


def test_a_stray_pixel_is_not_enough():
    relevance = torch.full((1, HEIGHT, WIDTH), 0.2)
    relevance[0, 5, 5] = 1.0  # one of 5 pixels that make the score
    (stray,) = answer(relevance, frame(), camera(), query("lamp")).answers
    assert not stray.found
    assert stray.score == pytest.approx((1 + 4 * 0.2) / 5, abs=1e-6)


def test_uncovered_pixels_do_not_count():
    seen = frame()
    seen.alphas[:, 40:] = 0.3
    relevance = blob(slice(0, 60), slice(40, 80))[None]  # relevant only where nothing is
    (nowhere,) = answer(relevance, seen, camera(), query("lamp")).answers
    assert not nowhere.found
    assert nowhere.score == pytest.approx(0.2, abs=1e-6)
    void = answer(relevance, frame(alpha=0.0), camera(), query("lamp"))
    assert void.answers[0].score == 0
    assert not void.masks.any()


def test_a_scene_without_atoms_has_nothing_whatever_the_threshold():
    relevance = torch.zeros(1, HEIGHT, WIDTH)
    for threshold in (-1.0, 0.0):
        result = answer(relevance, frame(), camera(), query("lamp", mode="cosine", num_atoms=0), threshold)
        assert not result.answers[0].found


def test_a_mask_needs_half_of_what_its_best_pixels_have():
    """Half of the log odds of 0.98 are those of 0.875, of 0.8 those of 2 / 3; a given threshold holds."""
    relevance = torch.stack([blob(slice(10, 30), slice(50, 70), best) for best in (0.98, 0.8, 0.45)])
    relevance[:, 40:50, 10:20] = 0.86
    relevance[1:, 40:50, 10:20] = 0.7
    relevance[2, 40:50, 10:20] = 0.42
    asked = query("door", "lamp", "rug", threshold=0.4)
    result = answer(relevance, frame(), camera(), asked)
    assert [int(mask.sum()) for mask in result.masks] == [400, 500, 500]
    assert [one.lit_from for one in result.answers] == pytest.approx([0.875, 2 / 3, 0.4], abs=1e-6)
    assert [one.threshold for one in result.answers] == [0.4] * 3
    chosen = answer(relevance, frame(), camera(), asked, 0.4)
    assert [int(mask.sum()) for mask in chosen.masks] == [500, 500, 500]
    assert [one.lit_from for one in chosen.answers] == [0.4] * 3


def test_threshold_decides_and_is_checked():
    relevance = blob(slice(10, 30), slice(50, 70), inside=0.6)[None]
    assert answer(relevance, frame(), camera(), query("lamp"), 0.55).answers[0].found
    strict = answer(relevance, frame(), camera(), query("lamp"), 0.7).answers[0]
    assert (strict.found, strict.maybe, strict.threshold) == (False, False, 0.7)
    near = answer(relevance, frame(), camera(), query("lamp"), 0.61).answers[0]
    assert (near.found, near.maybe) == (False, True)
    bad_ones: list[tuple[float, Mode]] = [
        (-0.1, "relevancy"),
        (1.1, "relevancy"),
        (-1.1, "cosine"),
        (math.nan, "cosine"),
    ]
    for bad, mode in bad_ones:
        with pytest.raises(PromptError, match="out of range"):
            answer(relevance, frame(), camera(), query("lamp", mode=mode), bad)


def test_several_phrases_keep_apart_and_sizes_must_agree():
    relevance = torch.stack((blob(slice(0, 10), slice(0, 10)), blob(slice(40, 60), slice(40, 80))))
    first, second = answer(relevance, frame(), camera(), query("lamp", "rug")).answers
    assert (first.prompt, second.prompt) == ("lamp", "rug")
    assert first.centroid is not None
    assert second.centroid is not None
    assert first.centroid[0] < 0 < second.centroid[0]
    with pytest.raises(ValueError, match="relevance: expected"):
        answer(relevance, frame(), camera(), query("lamp"))


def test_world_points_undo_the_camera():
    turn = quats_to_matrices(torch.tensor([0.9, 0.1, -0.3, 0.2]))
    viewmat = torch.eye(4)
    viewmat[:3, :3], viewmat[:3, 3] = turn, torch.tensor([0.5, -1.0, 2.0])
    points = world_points(torch.full((HEIGHT, WIDTH), 3.0), camera(viewmat))
    back = points @ turn.T + viewmat[:3, 3]
    # Pixel (x, y) = (10.5, 20.5) at z = 3; float32 of numbers below 10.
    assert back[20, 10].tolist() == pytest.approx([(10.5 - 40) / 70 * 3, (20.5 - 30) / 70 * 3, 3.0], abs=1e-5)


def test_world_points_undo_parallel_rays():
    g = torch.Generator().manual_seed(0)
    seen = camera()
    flat = replace(seen, orthographic=True)
    depths = 1 + torch.rand(HEIGHT, WIDTH, generator=g)
    points = world_points(depths, flat)
    pos_c = points @ flat.viewmat[:3, :3].T + flat.viewmat[:3, 3]
    torch.testing.assert_close(pos_c[..., 2], depths)
    pos_px = pos_c[..., :2] * flat.K.diagonal()[:2] + flat.K[:2, 2]
    torch.testing.assert_close(pos_px, pixel_grid(WIDTH, HEIGHT, like=depths), rtol=0, atol=1e-3)


def test_the_centroid_follows_the_weights():
    points = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 4, 0]])
    assert weighted_centroid(points, torch.tensor([1.0, 3, 0])).tolist() == [0.75, 0, 0]
    assert weighted_centroid(points, torch.zeros(3)).tolist() == pytest.approx([1 / 3, 4 / 3, 0])


def test_a_ball_takes_the_worlds_axes():
    directions = torch.nn.functional.normalize(
        torch.randn(2000, 3, generator=torch.Generator().manual_seed(1)), dim=1
    )
    half = directions[directions[:, 2] < 0]  # the side that a camera sees
    assert oriented_box(half)["axes"] == torch.eye(3).tolist()


def test_the_box_finds_a_turned_block_in_spite_of_outliers():
    generator = torch.Generator().manual_seed(0)
    turn = quats_to_matrices(torch.tensor([0.8, 0.2, 0.5, -0.1]))
    block = (torch.rand(20000, 3, generator=generator) - 0.5) * torch.tensor([4.0, 2.0, 1.0])
    points = block @ turn.T + torch.tensor([1.0, -2.0, 5.0])
    points[:40] = torch.tensor([3.0, 3.0, 9.0])  # 0.2 % bleed far away
    box = oriented_box(points)
    axes = torch.tensor(box["axes"])
    # 96 % of each side; outliers and sampling move it by a few per cent.
    assert box["size"] == pytest.approx([3.84, 1.92, 0.96], rel=0.05)
    assert box["center"] == pytest.approx([1.0, -2.0, 5.0], abs=0.05)
    assert (axes @ turn).abs().diagonal().tolist() == pytest.approx([1, 1, 1], abs=5e-3)
    assert torch.linalg.det(axes).item() == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_boxes_of_few_or_equal_points_are_finite(count):
    for points in (torch.ones(count, 3), torch.arange(count * 3.0).reshape(count, 3)):
        box = oriented_box(points)
        flat = [*box["center"], *box["size"], *(value for row in box["axes"] for value in row)]
        assert all(math.isfinite(value) for value in flat)
        assert min(box["size"]) >= 0
        axes = torch.tensor(box["axes"])
        torch.testing.assert_close(axes @ axes.T, torch.eye(3), rtol=0, atol=1e-6)


def test_presence_scores_take_at_least_one_pixel():
    relevance = torch.tensor([[[0.1, 0.7], [0.3, 0.2]]])
    assert presence_scores(relevance, torch.tensor([[True, True], [False, False]])).tolist() == pytest.approx(
        [0.7]
    )
    assert presence_scores(relevance, torch.zeros(2, 2, dtype=torch.bool)).tolist() == [0.0]
