"""The plain ViT against its twin in timm: same tensors by name, same numbers to the bit."""

import pytest
import torch

from langflash_core.base.torchvision_fix import ensure_torchvision
from langflash_core.network import MINI
from langflash_core.network.encoders.plain import PlainViT


@pytest.fixture(scope="module")
def twins():
    try:
        ensure_torchvision()
    except ImportError:
        pytest.skip("without torchvision there is no timm, the twin of these tests")
    timm = pytest.importorskip("timm", reason="timm is the twin of these tests")
    torch.manual_seed(0)
    theirs = timm.create_model(
        "vit_small_patch14_dinov2", pretrained=False, num_classes=0, dynamic_img_size=True
    )
    with torch.no_grad():
        for parameter in theirs.parameters():  # fresh blocks add next to nothing, so nothing would show
            parameter.normal_(0, 0.05)
    ours = PlainViT(MINI)
    ours.load_state_dict(theirs.state_dict())
    return ours.eval(), theirs.eval()


@pytest.mark.parametrize("size", [(518, 518), (196, 252), (56, 70), (532, 518)])
def test_same_numbers_as_the_twin_whatever_the_shape(twins, size):
    """At the trained grid, below it, far below, and above it on one side."""
    ours, theirs = twins
    images = torch.randn(1, 3, *size, generator=torch.manual_seed(1))
    with torch.inference_mode():
        expected = theirs.get_intermediate_layers(images, n=list(MINI.hooks), norm=True)
        found = ours(images, MINI.hooks)
    assert len(found) == len(MINI.hooks)
    for mine, other in zip(found, expected, strict=True):
        assert torch.equal(mine, other)


def test_the_network_imports_neither_timm_nor_torchvision():
    """A second of the start belonged to them."""
    import subprocess
    import sys

    code = (
        "import sys, langflash_core.pipeline\n"
        "heavy = {'timm', 'torchvision', 'open_clip', 'sympy', 'torch._dynamo'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
