"""SAM 2 where it is installed, and what is said where it is not."""

import pytest
import torch

from langflash_core.base.resources import weights_folder
from langflash_core.errors import WeightsError
from langflash_core.network.semantics.sam2 import CONFIGS, GRID, Sam2, sam2_checkpoint


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path))
    weights_folder().mkdir(parents=True)


def test_without_sam_2_it_says_what_to_do():
    assert sam2_checkpoint() is None
    with pytest.raises(WeightsError, match=r"install its package .* sam2.1_hiera_tiny.pt, into"):
        Sam2("cpu")


@pytest.mark.slow
def test_masks_of_a_drawn_sam_2():
    build_sam = pytest.importorskip("sam2.build_sam")
    path = weights_folder() / "sam2.1_hiera_tiny.pt"
    torch.manual_seed(0)
    torch.save({"model": build_sam.build_sam2(CONFIGS[path.name], device="cpu").state_dict()}, path)
    found = Sam2("cpu")(torch.rand(3, 64, 96))
    assert found.logits.shape == (3 * GRID**2, 64, 96) and found.scores.shape == (3 * GRID**2,)
    assert ((found.scores >= 0) & (found.scores <= 1)).all()
    path.write_bytes(b"no model")
    with pytest.raises(WeightsError, match=r"not a checkpoint of SAM 2"):
        Sam2("cpu")
