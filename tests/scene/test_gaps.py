"""Gaps of a picture are filled by what is around them, and nothing else changes."""

import numpy as np
import pytest
import torch

from langflash_core.scene.gaps import fill_gaps, num_levels, pull_level, push_level


def picture(height: int, width: int) -> tuple[torch.Tensor, torch.Tensor]:
    """A ramp of colours over black, half of the pixels partly covered, some not at all."""
    generator = torch.Generator().manual_seed(7)
    rows, columns = torch.meshgrid(
        torch.linspace(0, 1, height, dtype=torch.float64),
        torch.linspace(0, 1, width, dtype=torch.float64),
        indexing="ij",
    )
    rgb = torch.stack((rows, columns, 1 - rows), -1)
    alphas = torch.rand(height, width, generator=generator, dtype=torch.float64)
    alphas = torch.where(alphas < 0.2, 0.0, (2 * alphas).clamp(max=1))
    return rgb * alphas[..., None], alphas


def plain_filled(rgb: np.ndarray, alphas: np.ndarray, levels: int) -> np.ndarray:
    """The same by loops over pixels."""
    fine = np.concatenate((rgb, alphas[..., None]), -1)
    if not levels:
        return fine
    height, width = (-(-side // 2) for side in fine.shape[:2])
    coarse = np.zeros((height, width, 4))
    for row in range(height):
        for column in range(width):
            total = fine[2 * row : 2 * row + 2, 2 * column : 2 * column + 2].sum((0, 1))
            coarse[row, column] = total / max(total[3], 1)
    coarse = plain_filled(coarse[..., :3], coarse[..., 3], levels - 1)
    shown = fine.copy()
    for row in range(fine.shape[0]):
        for column in range(fine.shape[1]):
            y, x = (row + 0.5) / 2 - 0.5, (column + 0.5) / 2 - 0.5
            top, left = int(np.floor(y)), int(np.floor(x))
            smooth = np.zeros(4)
            for i, share_y in ((top, 1 - (y - top)), (top + 1, y - top)):
                for j, share_x in ((left, 1 - (x - left)), (left + 1, x - left)):
                    texel = coarse[np.clip(i, 0, height - 1), np.clip(j, 0, width - 1)]
                    smooth += share_y * share_x * texel
            shown[row, column] += (1 - fine[row, column, 3]) * smooth
    return shown


@pytest.mark.parametrize("size", [(32, 32), (41, 67), (17, 200), (3, 5), (1, 1)])
def test_it_is_pull_and_push(size) -> None:
    rgb, alphas = picture(*size)
    expected = plain_filled(rgb.numpy(), alphas.numpy(), num_levels(size[1], size[0]))
    # Sums of the same numbers in another order.
    torch.testing.assert_close(
        fill_gaps(rgb, alphas), torch.from_numpy(expected[..., :3]), rtol=0, atol=1e-14
    )
    single = fill_gaps(rgb.float(), alphas.float()).double()
    torch.testing.assert_close(single, torch.from_numpy(expected[..., :3]), rtol=0, atol=2e-6)


def test_what_is_covered_stays() -> None:
    rgb, _ = picture(40, 60)
    assert torch.equal(fill_gaps(rgb, torch.ones(40, 60, dtype=torch.float64)), rgb)


def test_a_crack_takes_the_colours_beside_it() -> None:
    rgb, alphas = torch.full((64, 64, 3), 0.5), torch.ones(64, 64)
    rgb[:, 30:32], alphas[:, 30:32] = 0, 0
    whole = fill_gaps(rgb, alphas)
    # Two pixels wide and aligned with the coarser picture: half of it comes from there, so from both sides.
    assert (whole[:, 30:32] > 0.49).all() and (whole <= 0.5 + 1e-6).all()


def test_far_from_everything_nothing_is_invented() -> None:
    rgb, alphas = torch.zeros(256, 256, 3), torch.zeros(256, 256)
    rgb[:, :16], alphas[:, :16] = 1, 1
    whole = fill_gaps(rgb, alphas)
    assert whole[:, 16:24].min() > 0.5  # beside what is drawn
    assert whole[:, 128:].max() == 0  # more than three times the reach away


def test_an_empty_picture_stays_empty() -> None:
    assert not fill_gaps(torch.zeros(20, 30, 3), torch.zeros(20, 30)).any()
    assert (fill_gaps(torch.zeros(20, 30, 3), torch.zeros(20, 30), 0.25) == 0.25).all()


def test_the_passes_keep_their_sizes() -> None:
    fine = torch.rand(7, 9, 4)
    assert pull_level(fine).shape == (4, 5, 4) and push_level(fine, pull_level(fine)).shape == (7, 9, 4)
