"""Depth as files: what is read back, times its scale, is what was written."""

import sys

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from langflash_core.errors import MissingPackageError, OutputError
from langflash_core.export.depth import LARGEST, fitting_step, lengths, write_depth_exr, write_depth_png
from langflash_core.types import Frame

DEPTHS = np.array([[0.0, 0.5, 1.0], [2.0, 3.7, 6.5]])


def test_a_png_times_its_step_is_the_depth(tmp_path):
    step = fitting_step(6.5)
    write_depth_png(tmp_path / "a.png", DEPTHS, step, "m")
    with Image.open(tmp_path / "a.png") as picture:
        values = np.asarray(picture)
        said = {name: picture.info[name] for name in ("step", "unit")}
    assert values.dtype == np.uint16 and said == {"step": "0.0001", "unit": "m"}
    assert np.abs(values * step - DEPTHS).max() <= step / 2 + 1e-12 and values[0, 0] == 0


def test_something_near_is_never_nothing(tmp_path):
    write_depth_png(tmp_path / "a.png", np.array([[1e-9, 1e9, 0.0]]), 1.0, "scene")
    assert np.asarray(Image.open(tmp_path / "a.png")).tolist() == [[1, LARGEST, 0]]


@given(st.floats(1e-6, 1e6))
def test_a_step_is_round_and_wastes_little(longest):
    step = fitting_step(longest)
    assert longest / step <= LARGEST * (1 + 1e-12)
    assert longest / step > LARGEST / 2.6  # 2 to 5 is the widest gap
    assert f"{step:.0e}"[0] in "125" and float(f"{step:.0e}") == step


def test_no_depth_at_all_has_a_step_too():
    assert fitting_step(0.0) > 0


def test_half_covered_pixels_have_depth_and_others_none():
    alphas = torch.tensor([[0.49, 0.5, 1.0]])
    frame = Frame(torch.zeros(1, 3, 3), alphas, torch.tensor([[1.0, 2.0, float("nan")]]))
    assert lengths(frame, None).tolist() == [[0.0, 2.0, 0.0]]
    assert lengths(frame, 2.5).tolist() == [[0.0, 5.0, 0.0]]


def test_an_exr_holds_the_depth_itself(tmp_path):
    exr = pytest.importorskip("OpenEXR")
    write_depth_exr(tmp_path / "a.exr", DEPTHS, "m")
    with exr.File(str(tmp_path / "a.exr")) as file:
        header, pixels = file.header(), file.channels()["Z"].pixels
        assert header["unit"] == "m" and pixels.dtype == np.float32
        assert np.array_equal(pixels, DEPTHS.astype(np.float32))


def test_an_exr_that_cannot_be_written_leaves_nothing(tmp_path):
    pytest.importorskip("OpenEXR")
    (tmp_path / "a.exr").mkdir()
    with pytest.raises(OutputError):
        write_depth_exr(tmp_path / "a.exr", DEPTHS, "m")
    assert [path.name for path in tmp_path.iterdir()] == ["a.exr"]


def test_without_its_package_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(MissingPackageError, match=r"langflash\[views\]"):
        write_depth_exr(tmp_path / "a.exr", DEPTHS, "m")
    assert not list(tmp_path.iterdir())
