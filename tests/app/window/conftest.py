"""Every test of the window has folders of its own: no test reads or writes a person's."""

from pathlib import Path

import pytest


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
