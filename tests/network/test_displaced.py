"""Weights come out of a file at any address; what is computed with them must not depend on it.

Matrix products may choose their way by the address of their numbers (MKL promises equal bits for equal
addresses modulo 64 alone), so weights are moved to where torch itself would have put them.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from langflash_core.network import MINI, load_network, save_network
from langflash_core.network.checkpoints.store import install, on_own_address
from langflash_core.network.checkpoints.stored import ALIGNMENT, read_stored
from tests.network import displaced, published
from tests.network.sizes import TINY

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def home(tmp_path_factory) -> Path:
    """A folder of imported weights of TINY."""
    folder = tmp_path_factory.mktemp("home")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LANGFLASH_HOME", str(folder))
        for name, state in (
            ("mixRe10kDl3dv.ckpt", published.draw_noposplat(TINY)),
            ("demo_e200.ckpt", published.draw_lseg(TINY, channels=512)),
            ("re10k.ckpt", published.draw_langflash(TINY)),
        ):
            torch.save({"state_dict": state}, folder / name)
            install(folder / name, TINY)
    return folder


@pytest.mark.parametrize("capability", ["default", "avx2", None], ids=str)
def test_the_same_bits_from_every_address(home, capability):
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    environment.pop("ATEN_CPU_CAPABILITY", None)
    if capability is not None:
        environment["ATEN_CPU_CAPABILITY"] = capability
    said = subprocess.run(
        [sys.executable, displaced.__file__, str(home)],
        env=environment, capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    assert len(said) == displaced.END // displaced.STEP
    assert len(set(said)) == 1


@pytest.mark.parametrize("displacement", range(0, displaced.END, displaced.STEP))
def test_a_displaced_tensor_is_moved(displacement):
    value = displaced.at(torch.arange(12.0), displacement)
    moved = on_own_address(value)
    assert moved.data_ptr() % ALIGNMENT == 0 and torch.equal(moved, value)
    assert (moved is value) == (displacement == 0)


def test_every_weight_of_mini_lies_where_torch_would_have_put_it(untrained, tmp_path):
    save_network(untrained, tmp_path / "mini.safetensors")
    network = load_network(MINI.name, tmp_path / "mini.safetensors")
    for name, value in network.state_dict().items():
        assert value.data_ptr() % ALIGNMENT == 0, name


def test_stored_numbers_arrive_whole_and_apart(tmp_path):
    """Sizes that fill no 64 bytes, one number, none, and a type that numpy lacks."""
    tensors = {
        "a": torch.arange(5, dtype=torch.float16),
        "b": torch.tensor(3.0),
        "c": torch.zeros(0, 7),
        "d": torch.tensor([[0.5, -2.0]], dtype=torch.bfloat16),
        "e": torch.arange(17.0),
    }
    save_file(tensors, tmp_path / "x.safetensors")
    arrays = read_stored(tmp_path / "x.safetensors").arrays
    for key, value in tensors.items():
        assert arrays[key].dtype == np.float32 and arrays[key].shape == tuple(value.shape)
        assert arrays[key].ctypes.data % ALIGNMENT == 0 or value.numel() == 0
        np.testing.assert_array_equal(arrays[key], value.float().numpy())
