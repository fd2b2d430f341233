"""Groups redrawn by MobileSAM: the plumbing, with drawn weights; the weights do not ship."""

import pytest
import torch
from safetensors.torch import save_file

from langflash_core.base.resources import weights_folder
from langflash_core.errors import InputError, WeightsError
from langflash_core.network.semantics.mobile_sam.model import MobileSam
from langflash_core.network.semantics.outlines import FILES, Outlines, apply_outlines, mobile_sam_checkpoint
from langflash_core.network.semantics.settings import OUTLINING
from langflash_core.pipeline import reconstruct
from tests.network.published import mobile_sam_file

SIDE = 128


@pytest.fixture(scope="module")
def sam() -> MobileSam:
    torch.manual_seed(0)
    model = MobileSam(SIDE).eval().requires_grad_(False)
    model.prompt_encoder.pe_layer.get_buffer("positional_encoding_gaussian_matrix").normal_()
    return model


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path))
    return tmp_path


def halves() -> torch.Tensor:
    """Two groups (2, 12, 16), left and right of column 8, which are not sure of it."""
    left = torch.where(torch.arange(16) < 8, 0.7, 0.3).expand(12, 16)
    return torch.stack((left, 1 - left))


def test_an_answer_that_means_the_same_redraws_its_group():
    """It moves the border to column 10; the other group says nothing and gives way."""
    logits = torch.zeros(2, 12, 16)
    logits[0] = torch.where(torch.arange(16) < 10, 20.0, -20.0)
    redrawn = apply_outlines(halves(), logits, torch.tensor([0.8, 0.0]))
    assert (redrawn[0, :, :10] > 0.9).all() and (redrawn[1, :, 10:] > 0.9).all()
    assert torch.allclose(redrawn.sum(0), torch.ones(12, 16))
    expected = 0.3 * torch.tensor(OUTLINING.sure).exp()
    assert redrawn[0, 0, 9] == pytest.approx(float(expected / (expected + 0.7)), abs=1e-6)


def test_an_answer_that_means_another_thing_changes_nothing():
    logits = 9 * torch.randn(2, 12, 16, generator=torch.Generator().manual_seed(1))
    assert torch.allclose(apply_outlines(halves(), logits, torch.tensor([0.4, 0.0])), halves(), atol=1e-5)


def test_every_photo_is_asked_at_its_own_size(sam):
    weights = torch.stack((halves(), halves().flip(0)))
    photos = [torch.rand(3, 36, 48, generator=torch.Generator().manual_seed(seed)) for seed in (1, 2)]
    redrawn = Outlines(sam)(weights, photos)
    assert redrawn.shape == weights.shape and bool(redrawn.isfinite().all())
    assert torch.allclose(redrawn.sum(1), torch.ones(2, 12, 16), atol=1e-5)
    assert Outlines(sam)(weights[:, :0], photos).shape == (2, 0, 12, 16)
    alone = torch.ones(1, 1, 12, 16)
    assert torch.allclose(Outlines(sam)(alone, photos[:1]), alone)


def test_groups_that_a_photo_hardly_shows_are_not_asked_for(sam):
    weights = torch.zeros(1, 2, 12, 16)
    weights[0, 0], weights[0, 1, 3, 4] = 0.6, 0.9
    redrawn = Outlines(sam)(weights, [torch.rand(3, 36, 48)])
    assert bool(redrawn.isfinite().all())


def test_weights_are_looked_for_by_name(sam, home):
    with pytest.raises(WeightsError, match=r"not at hand; put the authors' mobile_sam.pt"):
        Outlines.load_installed("cpu")
    weights_folder().mkdir(parents=True)
    save_file(mobile_sam_file(sam), weights_folder() / FILES[0])
    assert mobile_sam_checkpoint() == weights_folder() / FILES[0]
    assert Outlines.load_installed("cpu", SIDE).model.side == SIDE


def test_a_reconstruction_says_what_is_missing(home):
    photos = ["assets/photos/books_left.jpg"]
    with pytest.raises(WeightsError, match="MobileSAM's weights are not at hand"):
        reconstruct(photos, grouping="mobile-sam")
    with pytest.raises(InputError, match="choose queries, mobile-sam, sam2"):
        reconstruct(photos, grouping="superpixels")
