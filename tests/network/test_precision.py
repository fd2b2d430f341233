"""Bfloat16 is used where it is quick, and only there."""

import math

import pytest
import torch
from torch.nn import functional as F

from langflash_core import reconstruct
from langflash_core.base.resources import asset_path
from langflash_core.errors import InputError
from langflash_core.images.views import load_views
from langflash_core.network import load_network, precision


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
    monkeypatch.setattr(torch.backends.cpu, "get_cpu_capability", lambda: "AVX512")
    a = torch.ones(4, 4)
    with precision.mixed_precision("cpu"):
        assert (a @ a).dtype is kind
    assert (a @ a).dtype is torch.float32


@pytest.mark.parametrize("told", ["AVX2", "DEFAULT"])
def test_a_processor_whose_units_are_hidden_keeps_float32_and_says_why(monkeypatch, told):
    """With AMX and without AVX-512 torch's attention in bfloat16 stops with an error of its own."""
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: {"amx_bf16": True})
    monkeypatch.setattr(torch.backends.cpu, "get_cpu_capability", lambda: told)
    a = torch.ones(4, 4)
    with precision.mixed_precision("cpu"):
        assert (a @ a).dtype is torch.float32
    photos = [asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")]
    with pytest.raises(InputError, match=r"ATEN_CPU_CAPABILITY.*--precision float32"):
        reconstruct(photos, precision="bfloat16", device="cpu")


@pytest.mark.skipif(precision.bfloat16_fails(), reason="ATEN_CPU_CAPABILITY hides what bfloat16 needs here")
def test_mini_in_bfloat16_stays_near_and_its_poses_stay_where_they_are():
    photos = [asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")]
    views = load_views(photos, fov=65)
    exact, mixed = (load_network("mini", bfloat16=kind).predict(views) for kind in (False, True))
    for value in (mixed.gaussians.means, mixed.weights, mixed.dictionary, mixed.viewmats, mixed.depths):
        assert value.dtype == torch.float32
    # Eight bits are .4 % a product; over the tokens of a depth they average to .1 to .2 %, on three pairs.
    change = (mixed.depths.log() - exact.depths.log()).abs()
    assert 0 < change.mean() < 0.006
    # Poses rest on matches of the photos; a depth map gives only their lengths.
    turn = mixed.viewmats[1, :3, :3] @ exact.viewmats[1, :3, :3].T
    assert turn.trace() > 1 + 2 * math.cos(math.radians(0.05))
    said = [
        F.normalize(torch.einsum("vkhw,kc->vhwc", p.weights, p.dictionary), dim=-1) for p in (exact, mixed)
    ]
    # A part more or less changes what its pixels say, the others stay: .9993 measured.
    assert (said[0] * said[1]).sum(-1).mean() > 0.99
