"""The dataclasses that cross stages: the little arithmetic they own."""

import pytest
import torch

from langflash_core.resources import asset_path, shader_path
from langflash_core.types import Camera, Gaussians, Scene, Semantics


def test_a_resized_camera_sees_the_same_rays():
    K = torch.tensor([[50.0, 0, 17], [0, 60.0, 13], [0, 0, 1]])
    camera = Camera(torch.eye(4), K, 40, 30).resized(80, 90)
    assert (camera.width, camera.height) == (80, 90)
    assert torch.allclose(camera.K, torch.tensor([[100.0, 0, 34], [0, 180.0, 39], [0, 0, 1]]))


def test_dense_weights_add_repeated_atoms():
    ids = torch.tensor([[0, 2], [1, 1]])
    values = torch.tensor([[0.75, 0.25], [0.5, 0.5]])
    semantics = Semantics(ids, values, torch.eye(3), "minilm")
    assert semantics.dense_weights().tolist() == [[0.75, 0, 0.25], [0, 1, 0]]


def test_no_atoms_give_an_empty_matrix():
    semantics = Semantics(
        torch.zeros(4, 0, dtype=torch.int64), torch.zeros(4, 0), torch.zeros(0, 8), "minilm"
    )
    assert semantics.dense_weights().shape == (4, 0)


def test_metadata_is_replaced_not_changed():
    empty = torch.zeros(0, 3)
    gaussians = Gaussians(empty, torch.zeros(0, 4), empty, torch.zeros(0), torch.zeros(0, 1, 3))
    semantics = Semantics(
        torch.zeros(0, 0, dtype=torch.int64), torch.zeros(0, 0), torch.zeros(0, 8), "minilm"
    )
    scene = Scene(gaussians, semantics, torch.eye(4)[None], torch.eye(3)[None], (4, 3), metadata={"a": 1})
    assert scene.with_metadata(b=2).metadata == {"a": 1, "b": 2}
    assert scene.metadata == {"a": 1}
    assert scene.camera(0, 8, 6).K[0, 0] == 2


@pytest.mark.parametrize("find", [asset_path, shader_path])
def test_a_missing_resource_names_the_remedy(find):
    with pytest.raises(FileNotFoundError, match="reinstall"):
        find("no/such.file")
