"""Language in few channels: what others splat instead of atoms, and how vectors are made of it again.

A basis of d directions (principal components of feature vectors, not centred, since splatting is linear and
empty space is 0), and a decoder of one hidden layer, whose units are drawn at random and whose output is a
ridge regression: closed form. LSM splats few channels and decodes them by a trained network of this kind.
Scenes here hold atoms; this is what they are measured against (`langflash bench`, `langflash lab eval
ablations`). C channels, d of them kept, h hidden units.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from langflash_core.language.settings import DECODING


def principal(features: Float[Tensor, "n C"], count: int) -> Float[Tensor, "d C"]:
    """Orthonormal directions of the largest second moments, the largest first."""
    moments = features.double().T @ features.double()
    _, directions = torch.linalg.eigh(moments)
    return directions.flip(1)[:, :count].T.float().contiguous()


@dataclass(frozen=True)
class Decoder:
    """z -> L: the basis' own answer, and what a hidden layer of relu(z / |z| A + b) adds to it.

    basis: (d, C). hidden: A (d, h); shift: b (h); out: (h, C).
    """

    basis: Float[Tensor, "d C"]
    hidden: Float[Tensor, "d h"]
    shift: Float[Tensor, " h"]
    out: Float[Tensor, "h C"]

    @staticmethod
    def fit(features: Float[Tensor, "n C"], channels: int) -> "Decoder":
        """Least squares over unit vectors, with `DECODING.ridge` of their mean square on the output."""
        basis = principal(features, channels)
        generator = torch.Generator().manual_seed(channels)
        hidden = torch.randn(channels, DECODING.hidden, generator=generator)
        shift = 0.5 * torch.randn(DECODING.hidden, generator=generator)
        coded = features @ basis.T
        units = _hidden_activations(coded, hidden, shift).double()
        missing = (F.normalize(features, dim=-1) - F.normalize(coded, dim=-1) @ basis).double()
        normal = units.T @ units
        normal += DECODING.ridge * normal.diagonal().mean() * torch.eye(DECODING.hidden, dtype=torch.float64)
        return Decoder(basis, hidden, shift, torch.linalg.solve(normal, units.T @ missing).float())

    def __call__(self, coded: Float[Tensor, "*n d"]) -> Float[Tensor, "*n C"]:
        """Only the direction of z counts, so half covered pixels are decoded as covered ones; where z is 0
        nothing is drawn, and nothing said."""
        said = (
            F.normalize(coded, dim=-1) @ self.basis
            + _hidden_activations(coded, self.hidden, self.shift) @ self.out
        )
        return torch.where((coded != 0).any(-1, keepdim=True), said, 0.0)


def _hidden_activations(coded: Tensor, hidden: Tensor, shift: Tensor) -> Tensor:
    return F.relu(F.normalize(coded, dim=-1) @ hidden + shift)
