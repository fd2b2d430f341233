"""Every test of the window has folders of its own: no test reads or writes a person's; and a room to show."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import torch

from app.window.scene.commands import SceneArrived
from app.window.scene.state import SceneInfo
from app.window.scene.work import describe_scene
from app.window.state import State
from app.window.viewport import Viewport
from tests.app.window.scenes import after, room


@pytest.fixture(autouse=True, scope="session")
def _own_folders(tmp_path_factory) -> None:
    import os

    os.environ["LANGFLASH_CONFIG"] = str(tmp_path_factory.mktemp("config"))
    os.environ["LANGFLASH_STATE"] = str(tmp_path_factory.mktemp("state"))


@pytest.fixture
def folders(monkeypatch, tmp_path: Path) -> Path:
    """Fresh folders for the preferences and the sessions of one test."""
    monkeypatch.setenv("LANGFLASH_CONFIG", str(tmp_path / "config"))
    monkeypatch.setenv("LANGFLASH_STATE", str(tmp_path / "state"))
    return tmp_path


@pytest.fixture(scope="session")
def info() -> SceneInfo:
    """The small room; nothing changes it."""
    return describe_scene(room(torch.eye(3)), serial=1, name="room")


@pytest.fixture
def shown(info: SceneInfo) -> State:
    return after(State(), SceneArrived(info))


@pytest.fixture
def viewport(context) -> Iterator[Viewport]:
    with context:
        made = Viewport(context)
        yield made
        made.release()
