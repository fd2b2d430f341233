"""Weights are read once for whoever holds the network, and again for who does not."""

import shutil
from pathlib import Path
from typing import Any, cast

import pytest
import torch

import langflash_core as lf
from langflash_core.base.resources import asset_path
from langflash_core.reconstruction import tools

PHOTO = asset_path("photos/books_left.jpg")
SMALL = 56  # pixels


@pytest.fixture
def reads(monkeypatch) -> list[Path]:
    """The checkpoints that were read, in order."""
    read, load = [], tools.load_network

    def watched(preset, path, *arguments, **options):
        read.append(path)
        return load(preset, path, *arguments, **options)

    monkeypatch.setattr(tools, "load_network", watched)
    return read


def test_a_held_network_is_read_once_and_again_when_its_file_changes(reads, tmp_path):
    path = Path(shutil.copy(asset_path("weights/mini.safetensors"), tmp_path / "own.safetensors"))
    networks = lf.Networks()

    def made():
        return lf.reconstruct([PHOTO], weights=path, size=SMALL, detail="low", networks=networks)

    first, second = made(), made()
    assert len(reads) == 1
    for name, values in vars(first.gaussians).items():
        assert torch.equal(values, getattr(second.gaussians, name)), name
    path.touch()
    made()
    assert len(reads) == 2


def test_who_holds_none_reads_each_time(reads):
    for _ in range(2):
        lf.reconstruct([PHOTO], size=SMALL, detail="low")
    assert len(reads) == 2


def test_one_network_at_most_is_kept():
    networks, made = lf.Networks(), []

    def read() -> Any:
        made.append(object())
        return made[-1]

    assert networks.get("a", read) is networks.get("a", read) is made[0]
    assert networks.get("b", read) is made[1]
    assert networks.get("a", read) is made[2]
    assert len(made) == 3


def test_a_read_that_fails_leaves_nothing_behind():
    networks, other = lf.Networks(), cast(Any, object())
    networks.get("a", lambda: other)

    def fails() -> Any:
        raise OSError("the disk")

    for _ in range(2):
        with pytest.raises(OSError, match="the disk"):
            networks.get("b", fails)
    assert networks.get("b", lambda: other) is other
