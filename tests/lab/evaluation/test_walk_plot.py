"""The plot of what more photos cost."""

import io

import numpy as np
import pytest
from PIL import Image

from langflash_core.lab.evaluation.walk_plot import walk_png


def drawn(rows: dict) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(walk_png({"by_photos": rows}))).convert("RGB")).astype(int)


def test_time_and_memory_are_drawn_where_they_are_known():
    pytest.importorskip("matplotlib")
    rows = {str(n): {"cpu_seconds": 4.0 * n, "memory_mb": 900.0 + 10 * n} for n in (4, 16, 64)}
    whole, slower = drawn(rows), drawn({**rows, "64": {"cpu_seconds": 900.0, "memory_mb": 1540.0}})
    width = whole.shape[1]
    assert (whole != slower)[:, : width // 2].any() and not (whole != slower)[:, width * 55 // 100 :].any()
    orange = np.abs(whole - [0xD9, 0x7B, 0x16]).sum(2) < 30
    assert orange[:, width // 2 :].any() and not orange[:, : width // 2].any()
    unknown = drawn({name: {**row, "memory_mb": None} for name, row in rows.items()})
    assert not (np.abs(unknown - [0xD9, 0x7B, 0x16]).sum(2) < 30).any()
    assert unknown.shape[1] == width // 2, "no empty axes"
