"""The sheet of photo pairs: what is on it, and what it refuses."""

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from app.cli.lab.sheets.pairs import _between
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.quaternions import quats_to_matrices

PHOTOS = Path(__file__).resolve().parents[3] / "assets" / "photos"
PAIR = (PHOTOS / "living_room_left.png", PHOTOS / "living_room_right.png")


def _pose(quat: tuple[float, ...], eye: tuple[float, ...]) -> torch.Tensor:
    pose = torch.eye(4)
    pose[:3, :3] = quats_to_matrices(torch.tensor(quat, dtype=torch.float32))
    pose[:3, 3] = torch.tensor(eye, dtype=torch.float32)
    return invert_rigid(pose)


def test_between_runs_from_one_pose_to_the_other():
    first, second = _pose((1, 0, 0, 0), (0, 0, 0)), _pose((0.8, 0, 0.6, 0), (1, 0, 2))
    torch.testing.assert_close(_between(first, second, 0.0), first)
    torch.testing.assert_close(_between(first, second, 1.0), second)
    middle = invert_rigid(_between(first, second, 0.5))
    torch.testing.assert_close(middle[:3, 3], torch.tensor([0.5, 0.0, 1.0]))
    turns = [float(middle[:3, :3].reshape(-1) @ invert_rigid(v)[:3, :3].reshape(-1)) for v in (first, second)]
    assert turns[0] == pytest.approx(turns[1], abs=1e-5)  # as far from one as from the other
    outside = invert_rigid(_between(first, second, -0.5))
    torch.testing.assert_close(outside[:3, 3], torch.tensor([-0.5, 0.0, -1.0]))


@pytest.mark.slow
def test_a_pair_fills_a_sheet(run, tmp_path):
    sheet = tmp_path / "sheet.png"
    outcome = run("lab", "eval", "photos", *PAIR, "-o", sheet, "--prompt", "plant", "trombone")
    assert outcome.code == 0 and "1 pair" in outcome.out
    with Image.open(sheet) as picture:
        pixels = np.asarray(picture.convert("RGB")).astype(int)
        assert picture.width % 8 == 0 and 240 < picture.height < 300  # eight cells in one row
    cells = np.split(pixels, 8, axis=1)
    assert all(cell[20:].std() > 5 for cell in cells)
    colour = [float((cell[20:-4].max(-1) - cell[20:-4].min(-1)).mean()) for cell in cells]
    assert colour[6] > 2 * colour[7] + 1  # the plant glows in a grey room, a trombone is not there


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ([PAIR[0], "-o", "sheet.png"], "photos come in pairs, but these are 1"),
        ([PAIR[0], "gone.png", "-o", "sheet.png"], "no photo at gone.png"),
        ([*PAIR, "-o", "sheet.txt"], "sheet.txt"),
        ([*PAIR, "-o", "sheet.png", "--prompt", " "], "prompt is empty"),
    ],
)
def test_bad_pairs(run, tmp_path, monkeypatch, words, hint):
    monkeypatch.chdir(tmp_path)
    outcome = run("lab", "eval", "photos", *words)
    assert outcome.code == 2 and hint in outcome.err and outcome.err.count("\n") == 1
    assert not list(tmp_path.iterdir())
