"""antimatter15's .splat: its 32 bytes, to the precision they have."""

import struct

import pytest
import torch

from langflash_core.errors import SceneFileError
from langflash_core.export import export, read
from langflash_core.geometry.harmonics import SH_C0
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.checks import check_scene
from tests.export.splats import ply_bytes, random_gaussians, stored_columns


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


def test_a_round_trip_keeps_what_eight_bits_can(tmp_path):
    before = random_gaussians(500, degree=1)
    export(bare_scene(before, "made"), tmp_path / "a.splat")
    assert (tmp_path / "a.splat").stat().st_size == 32 * 500
    scene = read(tmp_path / "a.splat")
    check_scene(scene)
    after = scene.gaussians
    assert torch.equal(after.means, before.means) and torch.equal(after.scales, before.scales)
    half = 0.5 / 255 + 1e-6  # of a step of 8 bits
    assert float((after.opacities - before.opacities).abs().max()) <= half
    shown = (0.5 + SH_C0 * before.sh[:, 0]).clamp(0, 1)
    assert float((0.5 + SH_C0 * after.sh[:, 0] - shown).abs().max()) <= half
    # Each of four numbers is off by at most 1/256, and by 1/128 where 1 is cut to 255.
    angles = (after.quats * before.quats).sum(-1).abs()
    assert float(angles.min()) > 1 - 2 * (1 / 128) ** 2
    assert after.sh.shape == (500, 1, 3)  # plain colours


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
    with pytest.raises(SceneFileError, match=word) as caught:
        read(tmp_path / "bad.splat")
    assert "\n" not in str(caught.value) and "; " in str(caught.value)


def test_rows_that_are_not_finite_are_counted(tmp_path):
    good = struct.pack("<6f8B", 1, 2, 3, 0.1, 0.2, 0.3, 255, 128, 0, 51, 255, 128, 128, 128)
    bad = struct.pack("<6f8B", float("inf"), 2, 3, 0.1, 0.2, 0.3, 255, 128, 0, 51, 255, 128, 128, 128)
    (tmp_path / "a.splat").write_bytes(3 * good + bad)
    scene = read(tmp_path / "a.splat")
    assert len(scene.gaussians) == 3 and "1 of 4" in scene.record.warnings[0]
