"""One randomly drawn network for all network tests: building it is the slow part."""

import pytest
import torch

from langflash_core.network import MINI, GuidedDepthNet


@pytest.fixture(scope="session")
def untrained() -> GuidedDepthNet:
    torch.manual_seed(0)
    return GuidedDepthNet(MINI).eval()
