"""The numbers of the bench mean what they say."""

import dataclasses

import pytest
import torch

from app.bench import measure
from app.bench.cases import in_float64
from app.bench.errors import View, errors_of, true_view
from app.bench.modes import MODES, Mode, modes_for
from app.bench.paths import Path
from langflash_core.splat import render
from tests.app.bench.conftest import silent, small_case
from tests.app.gl.questions import full_relevance
from tests.app.gl.test_gl_lifetime import living
from tests.splat.scenes import maps_of


@pytest.fixture(scope="module")
def rows(context):
    """(times, errors) of every mode, by name."""
    case = small_case()
    with context:  # current, whoever else drew in between
        result = measure(context, case, modes_for(case.scene), silent)
    return {mode.name: (times, errors) for mode, times, errors in result.rows}


def test_every_mode_is_measured_on_every_frame(rows):
    assert set(rows) == {mode.name for mode in MODES}
    for name, (times, _) in rows.items():
        for samples in (times.frames, times.cpu, times.answers, times.phrases):
            expected = 0 if name == "fast relevance" and samples is times.answers else 2  # it has no maps
            assert len(samples) == expected and all(sample >= 0 for sample in samples)
        assert min(times.frames) > 0 and min(times.phrases) > 0


def test_the_default_is_near_the_reference_and_float32_nearer(rows):
    half, single = rows["default"][1], rows["float32"][1]
    assert half.psnr >= 50 and half.relevance_mean <= 2e-3  # what float16 can hold
    assert single.psnr >= 80 and single.relevance_mean <= 1e-4  # as tests/app/gl
    assert half.relevance_mean <= half.relevance_max
    assert half.mask_iou is not None and half.mask_iou > 0.98


def test_fewer_weights_lose_more_and_no_colour(rows):
    errors = [rows[f"m = {kept}"][1] for kept in (1, 2, 4, 8)]
    means = [each.relevance_mean for each in errors]
    assert means == sorted(means, reverse=True)
    assert means[0] > 100 * rows["default"][1].relevance_mean
    assert {each.psnr for each in errors} == {rows["default"][1].psnr}


def test_the_fast_mode_is_near_but_not_exact(rows):
    exact, fast = rows["default"][1], rows["fast relevance"][1]
    assert fast.psnr == exact.psnr
    assert 2 * exact.relevance_mean < fast.relevance_mean < 0.1
    # In processor time, which a busy machine does not lengthen; the default draws two passes of maps more.
    assert min(rows["fast relevance"][0].cpu) < min(rows["default"][0].cpu)


def test_halves_lose_something(rows):
    for name in ("half resolution", "quarter of Gaussians"):
        assert rows[name][1].psnr < rows["default"][1].psnr - 10


def test_all_weights_are_the_scene_itself(gl, case):
    stored = case.scene.semantics.weight_ids.shape[1]
    assert Mode("weights", "all", kept=stored).scene(case.scene) is case.scene
    fewer = Mode("weights", "m = 2", kept=2).scene(case.scene).semantics
    assert fewer.weight_values.shape == (400, 2)
    assert torch.allclose(fewer.weight_values.sum(-1), torch.ones(400))
    assert torch.equal(fewer.weight_ids[:, 0], case.scene.semantics.weight_ids[:, 0])
    assert [mode.kept for mode in modes_for(fewer_scene(case, 4)) if mode.axis == "weights"] == [1, 2]


def fewer_scene(case, kept):
    return Mode("weights", "fewer", kept=kept).scene(case.scene)


def test_only_the_axes_asked_for(gl, case):
    asked = modes_for(case.scene, ["precision", "relevance"])
    assert [mode.name for mode in asked] == ["default", "float32", "fast relevance"]


def test_the_default_must_come_first(gl, case):
    with pytest.raises(ValueError, match="default first"):
        measure(gl, case, MODES[1:2], silent)


def test_a_picture_of_one_pixel(gl, case):
    tiny = dataclasses.replace(
        case, path=Path(tuple(c.with_size(1, 1) for c in case.path.cameras), "by hand")
    )
    for mode, times, errors in measure(gl, tiny, modes_for(case.scene, ["resolution"]), silent).rows:
        assert len(times.frames) == 2 and 0 <= errors.relevance_max <= 1, mode.name


def test_nothing_is_left_behind(gl, case):
    measure(gl, case, modes_for(case.scene), silent)
    before = living(gl)
    measure(gl, case, modes_for(case.scene), silent)
    assert living(gl) == before


def test_the_truth_is_the_reference(case):
    camera = case.path.cameras[1]
    truth = true_view(case, camera)
    frame = render(in_float64(case.scene), camera)
    assert torch.equal(truth.rgb, frame.rgb)
    expected = full_relevance(case.scene, case.compiled, maps_of(frame))  # tests' own twin
    assert (truth.relevance - expected).abs().max() <= 1e-12  # both float64
    assert truth.covered.double().mean() > 0.2


def _view(rgb: float, relevance: float, size=(4, 6)) -> View:
    covered = torch.zeros(size, dtype=torch.bool)
    covered[:2] = True
    return View(torch.full((*size, 3), rgb), torch.full((2, *size), relevance), covered)


def test_errors_by_hand():
    mine, true = _view(0.6, 0.75), _view(0.5, 0.5)
    mine.relevance[:, 2:] = 0.0  # not covered: does not count
    mine.relevance[1, 0, 0] = 0.0
    errors = errors_of([mine], [true], threshold=0.5)
    assert errors.psnr == pytest.approx(20, abs=1e-4)
    assert errors.relevance_max == 0.5
    assert errors.relevance_mean == pytest.approx((23 * 0.25 + 0.5) / 24)
    assert errors.mask_iou == pytest.approx(23 / 24)
    assert errors_of([true], [true], threshold=0.9).mask_iou is None
    assert errors_of([true], [true], threshold=0.5) == type(errors)(float("inf"), 0.0, 0.0, 1.0)


def test_a_smaller_picture_is_magnified():
    assert errors_of([_view(0.5, 0.25, (2, 3))], [_view(0.5, 0.25)], 0.5).relevance_max == 0
