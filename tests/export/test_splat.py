"""antimatter15's .splat: its 32 bytes, to the precision they have."""

import struct

import pytest
import torch

from langflash_core.export import export, read
from langflash_core.geometry.harmonics import SH_C0
from tests.export.splats import ply_bytes, refusal, stored_columns


def test_one_row_by_hand(tmp_path):
    """Laid out with struct, after the format's README."""
    row = struct.pack("<6f8B", 1, 2, 3, 0.1, 0.2, 0.3, 255, 128, 0, 51, 255, 128, 128, 128)
    (tmp_path / "a.splat").write_bytes(row)
    gaussians = read(tmp_path / "a.splat").gaussians
    assert gaussians.means.tolist() == [[1, 2, 3]]
    assert torch.allclose(gaussians.scales, torch.tensor([[0.1, 0.2, 0.3]]))
    assert torch.allclose(0.5 + SH_C0 * gaussians.sh[0, 0], torch.tensor([1.0, 128 / 255, 0.0]), atol=1e-6)
    assert gaussians.opacities.tolist() == pytest.approx([0.2])
    assert gaussians.quats.tolist() == [[1, 0, 0, 0]]
    export(read(tmp_path / "a.splat"), tmp_path / "b.splat")
    assert (tmp_path / "b.splat").read_bytes() == row


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "empty"),
        (bytes(33), "cut off"),
        (bytes(320), "not a .splat"),
        (b"a shopping list with milk, eggs!" * 20, "not a .splat"),
        (ply_bytes(stored_columns(64))[: 32 * 100], "not a .splat"),
        (struct.pack("<6f8B", *[float("nan")] * 6, 9, 9, 9, 9, 255, 128, 128, 128) * 3, "not "),
    ],
)
def test_what_is_no_splat_is_refused_in_one_sentence(tmp_path, content, word):
    (tmp_path / "bad.splat").write_bytes(content)
    assert word in refusal(lambda: read(tmp_path / "bad.splat"))
