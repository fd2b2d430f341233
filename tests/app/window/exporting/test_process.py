"""Exports by the real command, in a process of their own."""

import signal
import threading
from pathlib import Path

import pytest
import torch

from app.window.exporting.process import Exporter
from langflash_core.scene.file import save
from tests.app.window.scenes import room

WAIT = 60.0  # seconds; an upper bound for a busy machine


class Export:
    """One export by the real command, with what it said."""

    def __init__(self, *words: str) -> None:
        self.ended, self.began = threading.Event(), threading.Event()
        self.result: tuple = ()
        self.exporter = Exporter(lambda *_: self.began.set(), self._end)
        self.exporter.start(("export", *words))

    def _end(self, *result) -> None:
        self.result = result
        self.ended.set()


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("desk") / "room.langflash"
    save(room(torch.eye(3)), path)
    return path


def test_a_real_export_writes_its_file(scene_file: Path, tmp_path: Path) -> None:
    export = Export(str(scene_file), "-o", str(tmp_path / "out.ply"))
    assert export.ended.wait(WAIT) and export.result[0] == 0, export.result
    assert str(tmp_path / "out.ply") in export.result[1] and (tmp_path / "out.ply").stat().st_size > 1000


def test_a_cancelled_export_leaves_nothing(scene_file: Path, tmp_path: Path) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # as in a window that a shell put in the background
    try:
        words = ("--size", "1600x1200", "--seconds", "60")
        export = Export(str(scene_file), "-o", str(tmp_path / "out.mp4"), *words)
    finally:
        signal.signal(signal.SIGINT, before)
    assert export.began.wait(WAIT)
    export.exporter.cancel()
    assert export.ended.wait(WAIT) and export.result[0] == 130, export.result
    assert list(tmp_path.iterdir()) == []
