"""The comparison of two versions: what differs is said, and times alone do not count."""

import io
import json
import struct

import numpy as np
import pytest
from PIL import Image
from safetensors.numpy import save

from tests.tools.same import ALIKE, ALONE, DIFFERENT, SAME, compared


def npz(**arrays: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def png(value: int) -> bytes:
    stream = io.BytesIO()
    Image.new("L", (2, 2), value).save(stream, "PNG")
    return stream.getvalue()


def scene(value: float, seconds: float) -> bytes:
    return save({"means": np.full(3, value, np.float32)}, {"record": json.dumps({"seconds": seconds})})


def glb(value: float, seconds: float) -> bytes:
    language = scene(value, seconds)
    said = json.dumps({"bufferViews": [{"byteLength": len(language)}]}).encode()
    head = struct.pack("<4sII", b"glTF", 2, 28 + len(said) + len(language))
    return (
        head
        + struct.pack("<I4s", len(said), b"JSON")
        + said
        + struct.pack("<I4s", len(language), b"BIN\0")
        + language
    )


@pytest.mark.parametrize(
    ("name", "first", "second", "verdict", "said"),
    [
        ("a.json", b'{"n": 1}', b'{"n": 1}', SAME, ""),
        ("a.json", b'{"n": 1, "seconds": 2}', b'{"n": 1, "seconds": 3}', ALIKE, "seconds"),
        ("a.json", b'{"n": 1, "seconds": 2}', b'{"n": 2, "seconds": 3}', DIFFERENT, "n '1' -> '2'"),
        ("a.json", b'{"n": [1, {"a": 1}]}', b'{"n": [1, {"b": 1}]}', DIFFERENT, "n[1].b in new alone"),
        (
            "a.npz",
            npz(x=np.zeros(3)),
            npz(x=np.array([0, 0, 0.5])),
            DIFFERENT,
            "x 1 of 3 values, by up to 0.5",
        ),
        ("a.npz", npz(x=np.zeros(3)), npz(x=np.zeros(4)), DIFFERENT, "x float64[3] -> float64[4]"),
        ("a.png", png(1), png(4), DIFFERENT, "pixels 4 of 4 values, by up to 3"),
        ("a.langflash", scene(1, 2), scene(1, 3), ALIKE, "said.record.seconds"),
        ("a.langflash", scene(1, 2), scene(2, 2), DIFFERENT, "tensors.means"),
        ("a.glb", glb(1, 2), glb(1, 3), ALIKE, "parts.0.said.record.seconds"),
        ("a.glb", glb(1, 2), glb(2, 3), DIFFERENT, "parts.0.tensors.means"),
        ("a.ply", b"abc", b"abd", DIFFERENT, "bytes 1 of 3"),
        ("a.ply", None, b"abd", ALONE, "new"),
    ],
)
def test_what_differs_is_said(tmp_path, name, first, second, verdict, said):
    for side, stored in (("old", first), ("new", second)):
        (tmp_path / side / "deep").mkdir(parents=True)
        if stored is not None:
            (tmp_path / side / "deep" / name).write_bytes(stored)
    [(path, found, what)] = compared(tmp_path / "old", tmp_path / "new")
    assert (path, found) == (f"deep/{name}", verdict) and said in what
