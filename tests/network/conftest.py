"""One randomly drawn network for all network tests: building it is the slow part."""

import pytest
import torch

from langflash_core.network import MINI, LangFlashNet


@pytest.fixture(scope="session")
def untrained() -> LangFlashNet:
    torch.manual_seed(0)
    return LangFlashNet(MINI).eval()
