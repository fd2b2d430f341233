"""What is splatted instead of atoms, and what makes language vectors of it again. C channels, d of them kept.

Everything is fitted in closed form on rooms of the training set, once: a basis of d directions (principal
components of L(x), not centred, since splatting is linear and empty space is 0), and a decoder of one hidden
layer whose hidden units are drawn at random and whose output is a ridge regression. LSM splats few channels
and decodes them by a trained network of this kind; here nothing is trained by gradient, for either side.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

HIDDEN = 512
RIDGE = 1e-3
PIXELS = 400
"""Of each room, evenly: 64 rooms make 25,600 examples of C numbers."""


def principal(features: Float[Tensor, "n C"], count: int) -> Float[Tensor, "d C"]:
    """Orthonormal directions of the largest second moments, the largest first."""
    moments = features.double().T @ features.double()
    _, directions = torch.linalg.eigh(moments)
    return directions.flip(1)[:, :count].T.float().contiguous()


@dataclass(frozen=True)
class Decoder:
    """z -> L: the basis' own answer, and what a hidden layer of relu(z / |z| A + b) adds to it.

    basis: (d, C). hidden: A (d, h); shift: b (h); out: (h, C), all None where the decoder is linear.
    """

    basis: Tensor
    hidden: Tensor
    shift: Tensor
    out: Tensor

    @staticmethod
    def fitted(features: Float[Tensor, "n C"], channels: int) -> "Decoder":
        """Least squares over unit vectors, with `RIDGE` of their mean square on the output."""
        basis = principal(features, channels)
        generator = torch.Generator().manual_seed(channels)
        hidden = torch.randn(channels, HIDDEN, generator=generator)
        shift = 0.5 * torch.randn(HIDDEN, generator=generator)
        coded = features @ basis.T
        units = _lit(coded, hidden, shift).double()
        missing = (F.normalize(features, dim=-1) - F.normalize(coded, dim=-1) @ basis).double()
        normal = units.T @ units
        normal += RIDGE * normal.diagonal().mean() * torch.eye(HIDDEN, dtype=torch.float64)
        return Decoder(basis, hidden, shift, torch.linalg.solve(normal, units.T @ missing).float())

    def __call__(self, coded: Float[Tensor, "*n d"]) -> Float[Tensor, "*n C"]:
        """Only the direction of z counts, so half covered pixels are decoded as covered ones."""
        return F.normalize(coded, dim=-1) @ self.basis + _lit(coded, self.hidden, self.shift) @ self.out


def _lit(coded: Tensor, hidden: Tensor, shift: Tensor) -> Tensor:
    return F.relu(F.normalize(coded, dim=-1) @ hidden + shift)


@dataclass(frozen=True)
class Examples:
    """Of training rooms: features (n, C) of pixels, and what atoms of theirs leave of them (n, C)."""

    features: Tensor
    left: Tensor


def gathered(rooms: Iterator[tuple[Tensor, Tensor]]) -> Examples:
    """Of pairs of features and what is left of them, (X, C) each, `PIXELS` evenly of each room."""
    features, left = [], []
    for own, rest in rooms:
        places = torch.linspace(0, len(own) - 1, min(PIXELS, len(own))).long()
        features.append(own[places])
        left.append(rest[places])
    return Examples(torch.cat(features), torch.cat(left))


def fitted_decoders(features: Float[Tensor, "n C"], channels: Sequence[int]) -> dict[int, Decoder]:
    """A decoder for each number of channels."""
    return {count: Decoder.fitted(features, count) for count in channels}
