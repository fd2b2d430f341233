"""Whether two versions make the same bytes: two pairs of photos by command line, API, batch and window.

    python -m tests.tools.same OUT OLD NEW [--ways command api batch window] [--only-compare]

OLD and NEW are checkouts, OUT a folder. Each version makes what it makes in processes of its own (`made`),
on one thread, so that sums have one order. Then every file and every canvas is compared byte by byte; of one
that differs it is said what in it does: tensors, keys, pixels. Times, memory and places of files differ from
run to run: where nothing else does, a file counts as the same but for these.
"""

import argparse
import io
import json
import os
import subprocess
import sys
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

WAYS = ("command", "api", "batch", "window")
FLEETING = (
    "seconds",
    "timings",
    "peak_memory_mb",
    "memory_mb",
    "stage_seconds",
    "date_created",
    "file_bytes",
)
"""Keys whose values no two runs have in common."""
SAME, ALIKE, DIFFERENT, ALONE = "same bytes", "same but for times", "different", "in one alone"
PACKING = "packing"
"""All values are the same, in another order, or under another date: safetensors and zip write such."""
_VERDICTS = (SAME, ALIKE, DIFFERENT, ALONE)
_MAKER = Path(__file__).with_name("made.py")


def make(checkout: Path, way: str, folder: Path) -> None:
    """What a version makes in one way.

    Raises:
        CalledProcessError: it does not get to the end.
    """
    env = dict(
        os.environ, PYTHONPATH=str(checkout), OMP_NUM_THREADS="1", LP_NUM_THREADS="1", PYTHONHASHSEED="0"
    )
    subprocess.run([sys.executable, str(_MAKER), way, str(folder)], env=env, cwd=checkout, check=True)


def compared(old: Path, new: Path) -> Iterator[tuple[str, str, str]]:
    """Path, verdict and what differs, of every file of two folders."""
    files = [{str(p.relative_to(top)): p for p in top.rglob("*") if p.is_file()} for top in (old, new)]
    for name in sorted(files[0].keys() | files[1].keys()):
        if not (name in files[0] and name in files[1]):
            yield name, ALONE, "old" if name in files[0] else "new"
            continue
        first, second = files[0][name].read_bytes(), files[1][name].read_bytes()
        if first == second:
            yield name, SAME, ""
            continue
        found = list(differences(name, first, second))
        yield name, ALIKE if all(_fleeting(each) for each in found) else DIFFERENT, "; ".join(found)


def _fleeting(difference: str) -> bool:
    return any(part in (PACKING, *FLEETING) for part in difference.split(" ")[0].split("."))


def differences(name: str, first: bytes, second: bytes) -> Iterator[str]:
    """What differs in two files of one name, each as "place what"; bytes where nobody can say more."""
    reader = next((read for ending, read in _READERS.items() if name.endswith(ending)), None)
    if reader is None:
        yield _of_bytes(first, second)
        return
    before, after = reader(first), reader(second)
    found = list(_of_values("", before, after))
    yield from found or [f"{PACKING} {_of_bytes(first, second)}"]


def _of_bytes(first: bytes, second: bytes) -> str:
    common = min(len(first), len(second))
    unlike = np.frombuffer(first, np.uint8, common) != np.frombuffer(second, np.uint8, common)
    return f"bytes {int(unlike.sum())} of {common}, sizes {len(first)} and {len(second)}"


def _of_values(place: str, first: Any, second: Any) -> Iterator[str]:
    """Places where two trees of dictionaries, lists, arrays and plain values differ."""
    if isinstance(first, dict) and isinstance(second, dict):
        for key in sorted(first.keys() | second.keys()):
            inner = f"{place}.{key}" if place else str(key)
            if key in first and key in second:
                yield from _of_values(inner, first[key], second[key])
            else:
                yield f"{inner} in {'old' if key in first else 'new'} alone"
    elif isinstance(first, list) and isinstance(second, list) and len(first) == len(second):
        for number, (one, other) in enumerate(zip(first, second, strict=True)):
            yield from _of_values(f"{place}[{number}]", one, other)
    elif isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        yield from _of_arrays(place, first, second)
    elif first != second:
        yield f"{place} {str(first)[:60]!r} -> {str(second)[:60]!r}"


def _of_arrays(place: str, first: np.ndarray, second: np.ndarray) -> Iterator[str]:
    if first.dtype != second.dtype or first.shape != second.shape:
        yield f"{place} {first.dtype}{list(first.shape)} -> {second.dtype}{list(second.shape)}"
    elif first.tobytes() != second.tobytes():
        apart = np.abs(first.astype(np.float64) - second.astype(np.float64))
        yield f"{place} {int((apart > 0).sum())} of {apart.size} values, by up to {np.nanmax(apart):.3g}"


# Readers of files: bytes to a tree of values.


def _json(stored: bytes) -> Any:
    return json.loads(stored)


def _npz(stored: bytes) -> dict:
    with np.load(io.BytesIO(stored)) as arrays:
        return dict(arrays)


def _npy(stored: bytes) -> dict:
    return {"values": np.load(io.BytesIO(stored))}


def _picture(stored: bytes) -> dict:
    with Image.open(io.BytesIO(stored)) as picture:
        return {"pixels": np.asarray(picture), "said": {k: str(v) for k, v in picture.info.items()}}


def _safetensors(stored: bytes) -> dict:
    size = int.from_bytes(stored[:8], "little")
    said = json.loads(stored[8 : 8 + size])
    parts = {
        name: np.frombuffer(stored, np.uint8, ends[1] - ends[0], 8 + size + ends[0])
        for name, entry in said.items()
        if name != "__metadata__"
        for ends in [entry["data_offsets"]]
    }
    return {"tensors": parts, "said": {k: _plain(v) for k, v in said.get("__metadata__", {}).items()}}


def _plain(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def _glb(stored: bytes) -> dict:
    """Each part of its buffer by itself; the language of a scene is a safetensors file in it."""
    size = int.from_bytes(stored[12:16], "little")
    said, body = json.loads(stored[20 : 20 + size]), stored[28 + size :]
    parts: dict[str, Any] = {}
    for number, view in enumerate(said.get("bufferViews", ())):
        begin = view.get("byteOffset", 0)
        part = body[begin : begin + view["byteLength"]]
        named = part[8:9] == b"{" and b"__metadata__" in part[:64]
        parts[str(number)] = _safetensors(part) if named else np.frombuffer(part, np.uint8)
    return {"said": said, "parts": parts}


def _zip(stored: bytes) -> dict:
    with zipfile.ZipFile(io.BytesIO(stored)) as archive:
        return {name: np.frombuffer(archive.read(name), np.uint8) for name in archive.namelist()}


_READERS: dict[str, Callable[[bytes], Any]] = {
    ".json": _json, ".npz": _npz, ".npy": _npy, ".png": _picture, ".langflash": _safetensors,
    ".safetensors": _safetensors, ".sog": _zip, ".usdz": _zip, ".glb": _glb,
}  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--only-compare", action="store_true", help="what was made before")
    given = parser.parse_args()
    table = []
    for way in given.ways:
        folders = [given.out.resolve() / side / way for side in ("old", "new")]
        if not given.only_compare:
            for checkout, folder in zip((given.old, given.new), folders, strict=True):
                make(checkout.resolve(), way, folder)
        rows = list(compared(*folders))
        counts = Counter(verdict for _, verdict, _ in rows)
        table.append(f"| {way} | {len(rows)} | " + " | ".join(str(counts[v]) for v in _VERDICTS) + " |")
        for name, verdict, what in rows:
            if verdict not in (SAME, ALIKE):
                sys.stdout.write(f"{way} {name}: {verdict}: {what[:400]}\n")
    heads = ["way", "files", *_VERDICTS]
    sys.stdout.write("\n".join([f"| {' | '.join(heads)} |", "|---" * len(heads) + "|", *table]) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
