"""What tests of films share."""

from pathlib import Path

import pytest

from langflash_core.base.apart import process


@pytest.fixture
def alone(monkeypatch, tmp_path: Path):
    """The decoder of OpenCV, without the program of imageio-ffmpeg."""
    (tmp_path / "imageio_ffmpeg.py").write_text("raise ImportError")
    monkeypatch.syspath_prepend(str(tmp_path))
    process.end_idle()
    yield
    process.end_idle()
