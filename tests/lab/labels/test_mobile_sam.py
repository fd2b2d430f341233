"""MobileSAM's shape is the published one, and its parts do what they say; its weights do not ship."""

import numpy as np
import pytest
import torch
from safetensors.torch import save_file

from langflash_core.errors import WeightsError
from langflash_core.lab.labels.prompted import PromptedSam, grid_points, stability
from langflash_core.network.semantics.mobile_sam.model import MobileSam, load_mobile_sam
from tests.network.published import mobile_sam_file as published_file

SIDE = 128


@pytest.fixture(scope="module")
def sam() -> MobileSam:
    torch.manual_seed(0)
    model = MobileSam(SIDE).eval().requires_grad_(False)
    model.prompt_encoder.pe_layer.get_buffer("positional_encoding_gaussian_matrix").normal_()
    return model


@pytest.fixture(scope="module")
def file(sam) -> dict[str, torch.Tensor]:
    return published_file(sam)


def test_tensors_are_as_many_and_as_large_as_in_the_published_file(file):
    assert (len(file), sum(value.numel() for value in file.values())) == (439, 10_140_231)


def test_every_tensor_of_the_file_is_used(sam, file, tmp_path):
    path = tmp_path / "sam.safetensors"
    save_file(file, path)
    state = load_mobile_sam(path, SIDE).state_dict()
    assert len(state) == len(file) - 4  # of the classifier
    assert all(torch.equal(state[name], value) for name, value in sam.state_dict().items())


@pytest.mark.parametrize("spoil", ["missing", "surplus"])
def test_a_file_with_other_tensors_is_refused(file, tmp_path, spoil):
    path, name = tmp_path / "sam.safetensors", "mask_decoder.iou_token.weight"
    kept = {other: value for other, value in file.items() if spoil == "surplus" or other != name}
    save_file(kept | ({"more": torch.zeros(3)} if spoil == "surplus" else {}), path)
    with pytest.raises(WeightsError, match="does not hold MobileSAM"):
        load_mobile_sam(path)


def test_a_photo_is_asked_by_points_and_by_rough_masks(sam):
    image = np.random.default_rng(0).integers(0, 255, (60, 90, 3), dtype=np.uint8)
    looked = sam.look(image)
    assert looked.features.shape == (1, 256, SIDE // 16, SIDE // 16)
    logits, scores = sam.by_points(looked, torch.tensor([[10.0, 20.0], [70.0, 50.0]]))
    assert logits.shape == (2, 3, SIDE // 4, SIDE // 4) and scores.shape == (2, 3)
    assert sam.on_photo(logits, looked).shape == (2, 3, 60, 90) and bool(logits.isfinite().all())
    again, _ = sam.by_points(looked, torch.tensor([[70.0, 50.0]]))
    assert torch.allclose(again[0], logits[1], atol=1e-4)  # prompts do not see each other
    rough = torch.full((1, 60, 90), -1.0)
    rough[:, 10:30, 10:40] = 1
    refined, _ = sam.by_masks(
        looked, rough, torch.tensor([[[25.0, 20.0]]]), torch.tensor([[10.0, 10, 40, 30]])
    )
    assert refined.shape == (1, 4, SIDE // 4, SIDE // 4)


def test_proposing_and_refining_gives_masks_of_the_photo_s_size(sam):
    image = np.random.default_rng(0).integers(0, 255, (60, 90, 3), dtype=np.uint8)
    every = PromptedSam(sam, grid=3, least_score=-9, least_stability=-1)
    found = every.propose(image)
    assert found.masks.shape == (3 * 6, 60, 90) and len(found.scores) == 18
    nowhere = every.propose(image, np.zeros((60, 90), bool))
    assert len(nowhere) == 0
    rough = np.zeros((2, 60, 90), bool)
    rough[0, 5:30, 5:30] = rough[1, 40:, 60:] = True
    refined = every.refine(image, rough, np.ones((60, 90), bool))
    assert refined.masks.shape == rough.shape and ((refined.scores >= 0) & (refined.scores <= 1)).all()
    assert len(every.refine(image, rough[:0], np.ones((60, 90), bool))) == 0


def test_points_lie_in_the_middle_of_their_cells_or_inside_what_is_wanted():
    every = grid_points((60, 90), 3, None)
    assert every.tolist() == [[15, 15], [45, 15], [75, 15], [15, 45], [45, 45], [75, 45]]
    where = np.zeros((60, 90), bool)
    where[50:60, 0:20] = True
    (point,) = grid_points((60, 90), 3, where)
    assert where[int(point[1]), int(point[0])]


def test_a_mask_that_hangs_on_a_threshold_is_not_stable():
    sharp, soft = torch.full((8, 8), -9.0), torch.zeros(8, 8)
    sharp[2:6, 2:6], soft[2:6, 2:6] = 9.0, 0.5
    assert stability(torch.stack([sharp, soft])).tolist() == [1.0, 0.0]


def test_other_weights_are_refused_in_a_sentence(tmp_path):
    path = tmp_path / "other.safetensors"
    save_file({"a": torch.zeros(3)}, path)
    with pytest.raises(WeightsError, match="does not hold MobileSAM"):
        load_mobile_sam(path)


def test_weights_are_read_as_half_precision_and_used_as_single(file, tmp_path):
    path = tmp_path / "half.safetensors"
    save_file({name: t.half() if t.is_floating_point() else t for name, t in file.items()}, path)
    read = load_mobile_sam(path, SIDE)
    assert all(p.dtype == torch.float32 for p in read.parameters()) and not read.training
