"""Folders of their own for what programs remember."""

from pathlib import Path

import pytest


@pytest.fixture
def own(tmp_path, monkeypatch) -> Path:
    for name in ("STATE", "CONFIG"):
        monkeypatch.setenv(f"LANGFLASH_{name}", str(tmp_path / name.lower()))
    return tmp_path
