"""Bfloat16 is used where it is quick, and only there."""

import pytest
import torch

from langflash_core.network import precision


@pytest.mark.parametrize(
    ("known", "kind"),
    [
        ({"amx_bf16": True}, torch.bfloat16),
        ({"avx512_bf16": True, "amx_bf16": False}, torch.bfloat16),
        ({"avx2": True, "amx_bf16": False}, torch.float32),
        ({}, torch.float32),
    ],
)
def test_products_on_a_processor(monkeypatch, known, kind):
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: known)
    a = torch.ones(4, 4)
    with precision.mixed("cpu"):
        assert (a @ a).dtype is kind
    assert (a @ a).dtype is torch.float32
