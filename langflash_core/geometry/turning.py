"""Gaussians in other axes: what a rotation or a mirror of the world does to each of their numbers.

With x' = M x, M orthogonal: mu' = M mu; Sigma' = M Sigma M^T, so R' = det(M) M R, which is a rotation
also where M is a mirror; colours are to look the same from where the camera has moved along,
c'(d) = c(M^T d). Axes are named as the field does: three letters, where +x, +y and +z point to, of
Right or Left, Down or Up, Forward or Back.
"""

from functools import lru_cache

import torch
from jaxtyping import Float
from torch import Tensor

from langflash_core.geometry.harmonics import MAX_SHOWN_DEGREE, sh_basis
from langflash_core.geometry.quaternions import matrices_to_quats, multiply_quats

_SIGNS = {"R": 1, "L": -1, "D": 1, "U": -1, "F": 1, "B": -1}  # along right, down, forward
_AXIS = {**dict.fromkeys("RL", 0), **dict.fromkeys("DU", 1), **dict.fromkeys("FB", 2)}


def axes_matrix(letters: str) -> Float[Tensor, "3 3"]:
    """M (3, 3) float64 from right-down-forward, the axes of a `Scene`, to those named, in either case."""
    matrix = torch.zeros(3, 3, dtype=torch.float64)
    for row, letter in enumerate(letters.upper()):
        matrix[row, _AXIS[letter]] = _SIGNS[letter]
    return matrix


def turned_quats(quats: Float[Tensor, "N 4"], matrix: Float[Tensor, "3 3"]) -> Float[Tensor, "N 4"]:
    """Quaternions wxyz (N, 4) of R' for those of R.

    Where M only turns axes round, R' = M R M: the same Gaussian, and the numbers keep their places.
    """
    diagonal = matrix.double().diagonal()
    if torch.equal(torch.diag(diagonal), matrix.double()):
        signs = torch.cat((diagonal.new_ones(1), diagonal * diagonal.prod()))
        return quats * signs.to(quats)
    turn = matrices_to_quats(matrix.double() * torch.linalg.det(matrix.double()))
    return multiply_quats(turn.to(quats), quats)


def turned_sh(sh: Float[Tensor, "N S 3"], matrix: Float[Tensor, "3 3"]) -> Float[Tensor, "N _ 3"]:
    """Coefficients (N, S, 3) of c'(d) = c(M^T d); degrees above 3, which nobody shows, are left out."""
    sh = sh[:, : (MAX_SHOWN_DEGREE + 1) ** 2]
    if sh.shape[1] == 1:
        return sh
    rows = tuple(float(value) for value in matrix.double().flatten())
    change = _sh_matrix(rows, int(sh.shape[1] ** 0.5) - 1).to(sh)
    return torch.einsum("ab,nbc->nac", change, sh)


@lru_cache(maxsize=64)
def _sh_matrix(rows: tuple[float, ...], degree: int) -> Tensor:
    """T (S, S) with c' = T c, float64.

    Y(d) c' = Y(M^T d) c for all d is linear, so directions enough and least squares give it to
    rounding; sign changes and quarter turns come out exact.
    """
    matrix = torch.tensor(rows, dtype=torch.float64).view(3, 3)
    rng = torch.Generator().manual_seed(0)
    directions = torch.randn(64, 3, generator=rng, dtype=torch.float64)
    directions = directions / directions.norm(dim=-1, keepdim=True)
    solved = torch.linalg.lstsq(sh_basis(directions, degree), sh_basis(directions @ matrix, degree)).solution
    nearest = solved.round()
    return torch.where((solved - nearest).abs() < 1e-9, nearest, solved)
