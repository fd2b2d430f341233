"""Losses against their loop twins, their gradients in float64, and empty or damaged input."""

import math

import numpy as np
import pytest
import torch
from torch.nn import functional as F

from langflash_core.lab.training import losses
from tests.lab.training import reference

# float64 sums in another order: rounding stays many digits below this.
EXACT = 1e-10
# `language_loss` and `instance_contrast` compute in float32 by design: sums of a few hundred terms.
SINGLE = 1e-5


@pytest.fixture
def depths():
    """Log depths (2, 12, 10) and true depths with holes and NaN, float64."""
    generator = torch.Generator().manual_seed(0)
    logs = torch.randn(2, 12, 10, generator=generator, dtype=torch.float64)
    truth = torch.rand(2, 12, 10, generator=generator, dtype=torch.float64) * 3 + 0.5
    truth[0, :3], truth[1, 4, 4] = 0, math.nan
    return logs, truth


def test_depth_loss_is_its_twin(depths):
    logs, truth = depths
    value = float(losses.depth_loss(logs, truth, absolute=0.3))
    assert value == pytest.approx(reference.depth_loss_twin(logs.numpy(), truth.numpy(), 0.3), abs=EXACT)


def test_a_common_factor_costs_only_the_absolute_part(depths):
    _, truth = depths
    exact = torch.where(truth > 0, truth, torch.ones_like(truth)).log()
    assert float(losses.depth_loss(exact, truth)) == pytest.approx(0, abs=EXACT)
    assert float(losses.depth_loss(exact + 0.5, truth, absolute=0.2)) == pytest.approx(0.1, abs=EXACT)


def test_gradient_loss_is_its_twin(depths):
    logs, truth = depths
    value = float(losses.gradient_loss(logs, truth, scales=3))
    assert value == pytest.approx(reference.gradient_loss_twin(logs.numpy(), truth.numpy(), 3), abs=EXACT)


def test_error_loss_is_lowest_at_the_mean_error(depths):
    logs, truth = depths
    residuals, valid = losses.log_residual(logs, truth)
    wanted = float(residuals.abs()[valid].mean().log())
    values = [
        float(losses.error_loss(logs, torch.full_like(logs, wanted + shift), truth, shared_offset=False))
        for shift in (-0.1, 0.0, 0.1)
    ]
    assert values[1] < values[0]
    assert values[1] < values[2]


def test_error_loss_does_not_move_the_depth(depths):
    logs, truth = depths
    logs = logs.requires_grad_()
    errors = torch.zeros_like(logs).requires_grad_()
    losses.error_loss(logs, errors, truth).backward()
    assert logs.grad is None
    assert errors.grad is not None


@pytest.mark.parametrize("loss", [losses.depth_loss, losses.gradient_loss])
def test_no_valid_pixel_gives_zero_with_a_gradient(loss):
    logs = torch.randn(2, 8, 8, requires_grad=True)
    value = loss(logs, torch.zeros(2, 8, 8))
    value.backward()
    assert float(value.detach()) == 0
    assert logs.grad is not None
    assert float(logs.grad.abs().sum()) == 0


def language_case(count: int):
    generator = torch.Generator().manual_seed(1)
    unit = [
        F.normalize(torch.randn(n, 6, generator=generator, dtype=torch.float64), dim=-1) for n in (count, 9)
    ]
    return torch.randn(count, 6, generator=generator, dtype=torch.float64), *unit


def test_language_loss_is_its_twin():
    features, targets, bank = language_case(7)
    value = float(losses.language_loss(features, targets.float(), bank.float()))
    twin = reference.language_loss_twin(features.numpy(), targets.numpy(), bank.numpy(), 14.0, 0.6, 0.5)
    assert value == pytest.approx(twin, rel=SINGLE)


def test_a_synonym_is_no_negative():
    target = F.normalize(torch.tensor([[1.0, 0.0, 0.0]]), dim=-1)
    synonym = F.normalize(torch.tensor([[1.0, 0.1, 0.0]]), dim=-1)
    assert float(losses.language_loss(target, target, synonym)) == pytest.approx(0, abs=1e-6)
    stranger = torch.tensor([[0.0, 1.0, 0.0]])
    assert float(losses.language_loss(target, target, stranger, temperature=1.0)) > 0.1


def test_what_is_true_is_no_negative_however_far():
    target = F.normalize(torch.tensor([[1.0, 0.0, 0.0]]), dim=-1)
    bank = F.normalize(torch.tensor([[0.0, 1.0, 0.0], [1.0, 0.1, 0.0]]), dim=-1)
    true = torch.tensor([[True, False]])
    kept = float(losses.language_loss(target, target, bank, true=true, temperature=1.0))
    near = float(losses.language_loss(target, target, bank[1:], synonym=1.0, temperature=1.0))
    assert kept == pytest.approx(near, rel=SINGLE)


def test_language_loss_of_no_pixels_is_zero():
    assert float(losses.language_loss(torch.zeros(0, 4), torch.zeros(0, 4), torch.eye(4))) == 0


def test_focal_and_dice_pairs_are_their_twins():
    generator = torch.Generator().manual_seed(2)
    logits = torch.randn(3, 20, generator=generator, dtype=torch.float64)
    masks = (torch.rand(2, 20, generator=generator) > 0.6).double()
    focal, dice = losses.focal_pairs(logits, masks), losses.dice_pairs(logits, masks)
    for n in range(3):
        for g in range(2):
            a, b = logits[n].numpy(), masks[g].numpy()
            assert float(focal[n, g]) == pytest.approx(reference.focal_twin(a, b), abs=EXACT)
            assert float(dice[n, g]) == pytest.approx(reference.dice_twin(a, b), abs=EXACT)


def test_instance_contrast_is_its_twin():
    generator = torch.Generator().manual_seed(3)
    features = torch.randn(9, 5, generator=generator, dtype=torch.float64)
    ids = torch.tensor([0, 0, 1, 1, 1, 2, 3, 3, 0])  # instance 2 has no partner and does not count
    value = float(losses.instance_contrast(features, ids))
    assert value == pytest.approx(reference.contrast_twin(features.numpy(), ids.numpy(), 10.0), rel=SINGLE)


def test_instance_contrast_without_partners_is_zero():
    assert float(losses.instance_contrast(torch.randn(3, 4), torch.arange(3))) == 0
    assert float(losses.instance_contrast(torch.zeros(0, 4), torch.zeros(0, dtype=torch.long))) == 0


def test_ssim_is_its_twin():
    generator = np.random.default_rng(4)
    left, right = generator.random((9, 11, 3)), generator.random((9, 11, 3))
    maps = losses.ssim_map(torch.from_numpy(left), torch.from_numpy(right))
    np.testing.assert_allclose(maps.numpy(), reference.ssim_twin(left, right), atol=EXACT)


def test_photometric_loss_of_equal_pictures_is_zero_and_differentiable():
    picture = torch.rand(8, 8, 3, dtype=torch.float64)
    mask = torch.ones(8, 8, dtype=torch.bool)
    assert float(losses.photometric_loss(picture, picture, mask)) == pytest.approx(0, abs=EXACT)
    other = (picture + 0.2).requires_grad_()
    assert torch.autograd.gradcheck(lambda x: losses.photometric_loss(x, picture, mask), (other,))


def test_the_teacher_term_is_absent_without_a_teacher():
    maps = torch.randn(1, 4, 3, 3)
    assert float(losses.teacher_loss(maps, None)) == 0
    assert float(losses.teacher_loss(maps, 2 * maps)) == pytest.approx(0, abs=1e-6)
    with pytest.raises(ValueError, match="teacher"):
        losses.teacher_loss(maps, torch.randn(1, 5, 3, 3))
