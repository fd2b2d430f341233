"""Boxes as glTF, read back by trimesh and, number by number, from the file's own JSON."""

import json
import struct

import numpy as np
import pytest
import trimesh

from langflash_core.errors import OutputError, PromptError
from langflash_core.export.glb import write_boxes

TURN = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])  # rows are axes
CHAIR = {"center": [1.0, 0.5, 3.0], "axes": TURN.tolist(), "size": [0.6, 1.0, 0.4]}
FLOOR = {"center": [0.0, 1.5, 2.0], "axes": np.diag([1.0, 1.0, -1.0]).tolist(), "size": [4.0, 0.0, 3.0]}


def corners(box: dict) -> np.ndarray:
    """(8, 3) in the scene's axes."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return np.array(box["center"]) + (signs * np.array(box["size"]) / 2) @ np.array(box["axes"])


def written(tmp_path, boxes) -> trimesh.Scene:
    path = tmp_path / "boxes.glb"
    write_boxes(boxes, path)
    loaded = trimesh.load_scene(path)
    return loaded


def test_a_box_stands_where_it_was_found(tmp_path):
    scene = written(tmp_path, [("armchair", CHAIR)])
    pose, name = scene.graph["armchair"]
    there = trimesh.transform_points(scene.geometry[name].vertices, pose)
    expected = corners(CHAIR) * [1, -1, -1]  # y up, z towards the viewer
    distances = np.linalg.norm(there[:, None] - expected[None], axis=2)
    assert distances.min(0).max() < 1e-5 and distances.min(1).max() < 1e-5
    assert scene.geometry[name].volume == pytest.approx(0.6 * 1.0 * 0.4, rel=1e-5)


def test_a_flat_or_mirrored_box_is_still_a_body(tmp_path):
    scene = written(tmp_path, [("floor", FLOOR)])
    pose, name = scene.graph["floor"]
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    assert scene.geometry[name].volume > 0
    there = trimesh.transform_points(scene.geometry[name].vertices, pose)
    assert np.allclose(np.ptp(there, axis=0), [4.0, 0.004, 3.0], atol=1e-5)


def test_names_and_colours(tmp_path):
    path = tmp_path / "boxes.glb"
    write_boxes([("armchair", CHAIR), ("armchair (view 1)", CHAIR), ("Stühle", FLOOR)], path)
    content = path.read_bytes()
    magic, version, size, length, kind = struct.unpack("<4sIII4s", content[:20])
    assert (magic, version, size, kind) == (b"glTF", 2, len(content), b"JSON")
    document = json.loads(content[20 : 20 + length])
    assert {"armchair", "armchair (view 1)", "Stühle"} <= {node.get("name") for node in document["nodes"]}
    colours = [material["pbrMetallicRoughness"]["baseColorFactor"] for material in document["materials"]]
    assert len({tuple(colour) for colour in colours}) == 3
    assert all(material["alphaMode"] == "BLEND" for material in document["materials"])


def test_nothing_found_writes_nothing(tmp_path):
    with pytest.raises(PromptError, match="threshold"):
        write_boxes([], tmp_path / "boxes.glb")
    assert not list(tmp_path.iterdir())


def test_unwritable(tmp_path):
    with pytest.raises(OutputError):
        write_boxes([("armchair", CHAIR)], tmp_path / "gone" / "boxes.glb")
