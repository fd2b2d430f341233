"""What torch and safetensors write is whole or not there, and a full disk is one sentence."""

import errno
import sys
from pathlib import Path

import pytest
import torch

from langflash_core.errors import OutputError
from langflash_core.lab.saving import save_whole
from langflash_core.lab.training.shards import write_shard
from tests.lab.training.conftest import toy_record
from tests.torture.failing import failing, small_disk

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the harness knows Linux")


def test_of_a_state_on_a_full_disk_the_old_one_stays(tmp_path: Path) -> None:
    path = tmp_path / "run" / "depth.pt"
    save_whole({"step": 1}, path)
    with small_disk(10_000), pytest.raises(OutputError, match="large; choose another place"):
        save_whole({"step": 2, "weights": torch.zeros(100_000)}, path)
    for kind, number in (("write", 1), ("place", 2)):  # of places the second is the rename
        with failing(kind, number, tmp_path, errno.ENOSPC), pytest.raises(OutputError, match="No space left"):
            save_whole({"step": 3}, path)
    assert torch.load(path) == {"step": 1}
    assert [each.name for each in path.parent.iterdir()] == ["depth.pt"]


def test_a_shard_on_a_full_disk_is_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "a.safetensors"
    with small_disk(1000), pytest.raises(OutputError, match=r"cannot write .*large.*; choose another place"):
        write_shard(path, [toy_record(0)])
    assert not list(tmp_path.iterdir())
