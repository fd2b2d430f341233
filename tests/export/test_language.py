"""Language beside plain splats: it comes back with them, and not with others."""

from pathlib import Path

import pytest
import torch

from langflash_core.base.records import Record
from langflash_core.export import export, read
from langflash_core.export.language import side_car
from langflash_core.scene.bare import bare_scene
from langflash_core.types import Scene, Semantics
from tests.export.splats import random_gaussians

NAMES = {".ply": "plain.language.safetensors", ".glb": None}


@pytest.fixture
def scene() -> Scene:
    """50 Gaussians with three weights each over five atoms, two photos."""
    rng = torch.Generator().manual_seed(4)
    values = torch.rand(50, 3, generator=rng)
    dictionary = torch.nn.functional.normalize(torch.randn(5, 8, generator=rng), dim=-1)
    ids = torch.stack([torch.randperm(5, generator=rng)[:3] for _ in range(50)])
    semantics = Semantics(ids, values / values.sum(-1, keepdim=True), dictionary, "minilm")
    Ks = torch.tensor([[40.0, 0, 20], [0, 40, 15], [0, 0, 1]]).repeat(2, 1, 1)
    viewmats = torch.eye(4).repeat(2, 1, 1)
    viewmats[1, 0, 3] = -0.25
    record = Record(photos=("a.jpg", "b.jpg"), calibration={"threshold": 0.7}, atom_names={1: "chair"})
    view_ids = torch.arange(50) % 2
    return Scene(
        random_gaussians(50, 1),
        semantics,
        viewmats,
        Ks,
        (40, 30),
        (b"jpeg one", b"jpeg two"),
        view_ids,
        record,
        (view_ids > 0).to(torch.uint8),
        torch.arange(50) / 255,
    )


def same_language(first: Scene, second: Scene) -> bool:
    close = torch.allclose(first.semantics.dense_weights(), second.semantics.dense_weights(), atol=1e-3)
    return (
        close
        and torch.equal(first.semantics.dictionary, second.semantics.dictionary)
        and torch.equal(first.viewmats, second.viewmats)
        and torch.equal(first.Ks, second.Ks)
        and first.view_ids is not None
        and second.view_ids is not None
        and torch.equal(first.view_ids, second.view_ids)
        and first.levels is not None
        and second.levels is not None
        and torch.equal(first.levels, second.levels)
        and first.confidences is not None
        and second.confidences is not None
        and torch.equal(first.confidences, second.confidences)
        and (first.view_size, first.photos, first.record, first.semantics.space)
        == (second.view_size, second.photos, second.record, second.semantics.space)
    )


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_language_travels_beside_the_splats(tmp_path, scene, suffix):
    path = tmp_path / f"plain{suffix}"
    export(scene, path)
    beside = NAMES[suffix]
    assert {file.name for file in tmp_path.iterdir()} == {path.name} | ({beside} if beside else set())
    assert same_language(scene, read(path))
    assert torch.equal(read(path).gaussians.means, scene.gaussians.means)


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_others_find_plain_splats(tmp_path, scene, suffix):
    """Without the side-car a .ply is what it always was; a .glb names its extension and requires none."""
    export(scene, tmp_path / f"plain{suffix}")
    if suffix == ".ply":
        side_car(tmp_path / "plain.ply").unlink()
        alone = read(tmp_path / "plain.ply")
        assert alone.semantics.num_atoms == 0 and alone.record.warnings == ()
    else:
        content = (tmp_path / "plain.glb").read_bytes()
        assert b'"extensionsUsed": ["KHR_gaussian_splatting", "LANGFLASH_language"]' in content
        assert b"extensionsRequired" not in content


def test_a_scene_without_language_leaves_nothing_beside(tmp_path, scene):
    export(bare_scene(scene.gaussians, "made"), tmp_path / "plain.ply")
    assert [file.name for file in tmp_path.iterdir()] == ["plain.ply"]


def refused(path: Path) -> str:
    """The warning with which a scene was read without its language."""
    scene = read(path)
    assert scene.semantics.num_atoms == 0 and len(scene.gaussians) > 0
    (warning,) = scene.record.warnings
    assert "\n" not in warning and "without it" in warning
    return warning


def test_language_of_other_gaussians_stays_out(tmp_path, scene):
    """Who sorted or removed some in another program gets no words on the wrong things."""
    export(scene, tmp_path / "plain.ply")
    beside = side_car(tmp_path / "plain.ply").read_bytes()
    order = torch.randperm(50, generator=torch.Generator().manual_seed(0))
    for name, rows in (("sorted", order), ("fewer", torch.arange(40))):
        gaussians = scene.gaussians.map(lambda values, rows=rows: values[rows])
        export(bare_scene(gaussians, "made"), tmp_path / f"{name}.ply")
        side_car(tmp_path / f"{name}.ply").write_bytes(beside)
        assert "other Gaussians" in refused(tmp_path / f"{name}.ply")


def test_a_damaged_side_car_costs_the_language_alone(tmp_path, scene):
    export(scene, tmp_path / "plain.ply")
    beside = side_car(tmp_path / "plain.ply")
    whole = beside.read_bytes()
    for content in (
        b"",
        whole[:100],
        whole[:-5],
        b"\xff" * 200,
        whole.replace(b'"version":"1"', b'"version":"9"'),
    ):
        beside.write_bytes(content)
        assert "damaged" in refused(tmp_path / "plain.ply")


@pytest.mark.parametrize("name", ["a.glb", "a.ply"])
def test_a_scene_gives_the_same_bytes_each_time(tmp_path, scene, name):
    """safetensors writes its strings in an order of chance."""
    contents = set()
    for _ in range(6):
        export(scene, tmp_path / name)
        contents.add(tuple(path.read_bytes() for path in sorted(tmp_path.iterdir())))
    assert len(contents) == 1
