"""Spherical harmonics: orthonormal, equal to scipy's, and clamped as the field does."""

import numpy as np
import torch
from scipy.special import sph_harm_y

from langflash_core.geometry.harmonics import SH_C0, colour_to_sh, sh_basis, sh_to_colour


def _directions(count: int = 200) -> torch.Tensor:
    directions = torch.randn(count, 3, dtype=torch.float64, generator=torch.manual_seed(0))
    return torch.nn.functional.normalize(directions, dim=-1)


def test_bases_equal_scipy_up_to_the_order_sign():
    """Real harmonics from complex ones; splatting keeps the Condon-Shortley sign of scipy's."""
    directions = _directions()
    x, y, z = directions.numpy().T
    theta, phi = np.arccos(z), np.arctan2(y, x)
    columns = []
    for degree in range(4):
        for order in range(-degree, degree + 1):
            value = sph_harm_y(degree, abs(order), theta, phi)
            part = value.real if order >= 0 else value.imag
            columns.append(part * (np.sqrt(2) if order else 1))
    assert np.allclose(sh_basis(directions, 3).numpy(), np.stack(columns, -1), atol=1e-9)


def test_colour_round_trip_and_clamp():
    colours = torch.rand(5, 3, dtype=torch.float64)
    assert torch.allclose(sh_to_colour(colour_to_sh(colours)[:, None], _directions(5)), colours, atol=1e-12)
    dark = torch.full((1, 1, 3), -10.0, dtype=torch.float64)
    assert sh_to_colour(dark, _directions(1)).max() == 0


def test_degree_four_is_kept_but_not_shown():
    sh = torch.zeros(1, 25, 3, dtype=torch.float64)
    sh[:, 16:] = 5.0
    assert torch.allclose(sh_to_colour(sh, _directions(1)), torch.full((1, 3), 0.5, dtype=torch.float64))


def test_degree_zero_is_the_constant():
    assert torch.allclose(sh_basis(_directions(), 0), torch.full((200, 1), SH_C0, dtype=torch.float64))
