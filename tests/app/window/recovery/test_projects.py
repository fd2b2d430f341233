"""What is remembered of scenes that were open lately: small, of that very file, and nothing else's."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.places import config_folder
from app.window.recovery import projects
from app.window.recovery.state import Kept, Project
from langflash_core.geometry.poses import Pose, Vector

POSE = Pose(Vector(0.1, 0.2, 0.3))


@pytest.fixture
def scene(folders: Path) -> Path:
    path = folders / "my room.langflash"
    path.write_bytes(b"a scene")
    return path


def seen(noise: int = 0) -> np.ndarray:
    """A red half and a blue one, with so much noise."""
    picture = np.zeros((700, 900, 3), np.uint8)
    picture[:, :450, 0] = picture[:, 450:, 2] = 200
    return picture + np.random.default_rng(0).integers(0, noise + 1, picture.shape, np.uint8)


def files() -> set[str]:
    return {file.suffix for file in (config_folder() / "projects").iterdir()}


def remember(scene: Path, **more) -> None:
    projects.keep(Kept(scene=str(scene), phrases=("a chair",), likes=("",), pose=POSE, **more), 4)
    projects.keep_picture(str(scene), seen(), projects.stamp(scene))


def test_a_scene_is_remembered_as_it_was_left(scene: Path) -> None:
    remember(scene)
    project = projects.read(str(scene))
    assert (project.kept.phrases, project.kept.pose, project.views) == (("a chair",), POSE, 4)
    assert project.sentence() == "4 photos, 1 phrase" and project.when is not None
    small = projects.picture(str(scene))
    assert small is not None and small.shape == (180, 270, 3)
    assert small[90, 20, 0] > 190 and small[90, 250, 2] > 190 and small[90, 20, 2] < 10


@pytest.mark.parametrize("noise", [0, 50])
def test_a_small_picture_takes_ten_kilobytes_at_the_most(scene: Path, noise: int) -> None:
    projects.keep_picture(str(scene), seen(noise), projects.stamp(scene))
    (file,) = (config_folder() / "projects").iterdir()
    assert file.stat().st_size <= 10 * 1024


def test_a_picture_of_what_the_file_was_before_is_neither_shown_nor_kept(scene: Path) -> None:
    """Somebody hid a part of it meanwhile, by the command line say."""
    remember(scene)
    scene.write_bytes(b"the scene without the part")
    assert projects.picture(str(scene)) is None and files() == {".json"}
    remember(scene)
    projects.keep_picture(str(scene), seen(), "langflash 7 1")  # the window still shows what was read before
    assert files() == {".json"}


@pytest.mark.parametrize("content", [b"", b"no picture", b"\xff\xd8\xff\xe0 cut off", bytes(2**20)])
def test_a_damaged_picture_is_none(scene: Path, content: bytes) -> None:
    remember(scene)
    (file,) = (config_folder() / "projects").glob("*.jpg")
    file.write_bytes(content)
    assert projects.picture(str(scene)) is None and files() == {".json"}


def test_a_picture_that_is_cut_off_or_foreign_is_none(scene: Path) -> None:
    remember(scene)
    (file,) = (config_folder() / "projects").glob("*.jpg")
    file.write_bytes(file.read_bytes()[:-500])
    assert projects.picture(str(scene)) is None
    Image.new("RGB", projects.SIDES).save(file, "JPEG")  # says of no file that it is of it
    assert projects.picture(str(scene)) is None
    file.mkdir()
    assert projects.picture(str(scene)) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda content: b"{",
        lambda content: b"[]",
        lambda content: json.dumps({**content, "views": "many"}).encode(),
        lambda content: json.dumps({**content, "session": {}}).encode(),
        lambda content: json.dumps({**content, "session": {**content["session"], "scene": 1}}).encode(),
        lambda content: json.dumps({**content, "session": {**content["session"], "phrases": [1]}}).encode(),
        lambda content: b" " * 2**20,
    ],
)
def test_of_a_damaged_record_the_path_is_left(scene: Path, change) -> None:
    remember(scene)
    (file,) = (config_folder() / "projects").glob("*.json")
    file.write_bytes(change(json.loads(file.read_bytes())))
    assert projects.read(str(scene)) == Project(str(scene), Kept(scene=str(scene)))


def test_what_belongs_to_no_recent_scene_is_swept_away(scene: Path) -> None:
    other = scene.with_name("other.langflash")
    other.write_bytes(b"another")
    remember(scene)
    remember(other)
    assert projects.sweep([str(other), str(scene)]) == (str(other), str(scene))
    assert len(list((config_folder() / "projects").iterdir())) == 4
    os.unlink(scene)
    assert projects.sweep([str(other), str(scene)]) == (str(other),)
    assert len(list((config_folder() / "projects").iterdir())) == 2
    assert projects.sweep([]) == () and list((config_folder() / "projects").iterdir()) == []
