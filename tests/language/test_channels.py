"""Few channels and their decoder."""

import torch
from torch.nn import functional as F

from langflash_core.language.channels import Decoder, principal


def test_a_decoder_beats_its_basis_and_needs_no_length():
    generator = torch.Generator().manual_seed(1)
    angles = 6.28 * torch.rand(3000, generator=generator)
    curve = torch.stack([torch.sin(k * angles + k) for k in range(1, 9)], -1)  # one number decides eight
    features = F.normalize(curve, dim=-1)
    decoder = Decoder.fit(features, 3)
    coded = features @ decoder.basis.T
    linear = F.normalize(coded @ decoder.basis, dim=-1)
    decoded = F.normalize(decoder(coded), dim=-1)
    wrong, less = (1 - (found * features).sum(-1).mean() for found in (linear, decoded))
    assert float(less) < 0.5 * float(wrong)
    assert torch.allclose(decoder(0.3 * coded), decoder(coded), atol=1e-4)  # float32, ridge weights up to 30
    assert not decoder(torch.zeros(2, 3)).any()  # empty space says nothing
    basis = principal(features, 3)
    assert torch.allclose(basis @ basis.T, torch.eye(3), atol=1e-5)
