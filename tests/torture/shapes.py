"""Damage that knows a file's build: it goes below wrappings and mends checksums, so readers get to the core.

Beside the blind damage of `tests/export/mutations.py`: values of JSON headers lie, numbers of packed arrays
become extreme, streams are packed again after what is in them was changed, words of texts are swapped.
"""

import gzip
import json
import re
import struct

import numpy as np
import safetensors.numpy

from langflash_core.scene.container import digest
from tests.export.mutations import damaged_inside, lied, mutated

JSON_NAMES = (".json", ".edits")
WORDS = [
    b"0",
    b"-1",
    b"1e308",
    b"nan",
    b"inf",
    b"4294967295",
    b"99999999999999999999",
    b"",
    b"x",
    b"\xff",
    b"1.5",
]
FLOATS = [np.nan, np.inf, -np.inf, 0.0, -0.0, 1e38, -1e38, 1e-45, 1.0]


def damaged(name: str, content: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    """A damaged copy of a file called `name`; blind in a third of the cases, or where its build is lost."""
    if rng.random() < 0.33:
        return mutated(content, other, rng)
    try:
        return _by_build(name, content, other, rng)
    except Exception:  # what was damaged before has no build any more
        return mutated(content, other, rng)


def _by_build(name: str, content: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    if name.endswith(JSON_NAMES):
        document = json.loads(content)
        for _ in range(rng.integers(1, 4)):
            document = lied(document, rng)
        return json.dumps(document).encode()
    if name.endswith((".langflash", ".safetensors")):
        return _tensors(content, rng)
    if name.endswith(".glb"):
        return _glb(content, other, rng)
    if name.endswith((".csv", ".txt")) or (name.endswith(".ply") and rng.random() < 0.7):
        return _words(content, rng)
    if name.endswith(".spz") and content[:2] == b"\x1f\x8b":
        return gzip.compress(_numbers(gzip.decompress(content), rng), 1)
    if name.endswith(".spz"):
        return _streams(content, rng)
    if name.endswith((".sog", ".npz")):
        return damaged_inside(name, content, other, rng)
    return _numbers(content, rng)


def _tensors(content: bytes, rng: np.random.Generator) -> bytes:
    """A safetensors file whose tensors or header lie, its checksum found right."""
    size = struct.unpack("<Q", content[:8])[0]
    strings = json.loads(content[8 : 8 + size])["__metadata__"]
    arrays = dict(sorted(safetensors.numpy.load(content).items()))
    for _ in range(rng.integers(1, 4)):
        if rng.random() < 0.5:
            inner = [key for key in ("scene", "language") if key in strings]
            key = inner[0]
            strings[key] = json.dumps(lied(json.loads(strings[key]), rng))
            continue
        name = list(arrays)[rng.integers(0, len(arrays))]
        arrays[name] = _array(arrays[name], rng)
        if rng.random() < 0.1:
            arrays[f"photo_{rng.integers(0, 3):03d}"] = arrays.pop(name)
    if "digest" in strings:
        strings["digest"] = digest(strings["scene"], arrays)
    return _saved(arrays, strings)


def _saved(arrays: dict[str, np.ndarray], strings: dict[str, str]) -> bytes:
    """As safetensors writes it, but in one order always."""
    header: dict = {"__metadata__": strings}
    body = b""
    for name, values in sorted(arrays.items()):
        kind = {"f": "F", "i": "I", "u": "U", "b": "BOOL"}[values.dtype.kind]
        end = len(body) + values.nbytes
        kind += str(8 * values.itemsize) if kind != "BOOL" else ""
        header[name] = {"dtype": kind, "shape": list(values.shape), "data_offsets": [len(body), end]}
        body += values.tobytes()
    head = json.dumps(header, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 8)
    return struct.pack("<Q", len(head)) + head + body


def _array(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    kind = rng.integers(0, 5)
    if kind == 0 and values.size:
        changed = values.copy().reshape(-1)
        extreme = (
            FLOATS if values.dtype.kind == "f" else [np.iinfo(values.dtype).max, np.iinfo(values.dtype).min]
        )
        with np.errstate(all="ignore"):
            changed[rng.integers(0, values.size, 3)] = np.array(extreme)[rng.integers(0, len(extreme))]
        return changed.reshape(values.shape)
    if kind == 1:
        return values[: rng.integers(0, len(values) + 1)] if values.ndim else values
    if kind == 2:
        return values.reshape(-1) if rng.random() < 0.5 else values[None]
    if kind == 3:
        types = ("u1", "i2", "i4", "f2", "f4", "f8")
        with np.errstate(all="ignore"):
            return values.astype(types[rng.integers(0, len(types))])
    return np.concatenate((values, values)) if values.ndim else values


def _glb(content: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    size = struct.unpack_from("<I", content, 12)[0]
    document, rest = json.loads(content[20 : 20 + size]), content[20 + size :]
    if rng.random() < 0.8:
        for _ in range(rng.integers(1, 3)):
            document = lied(document, rng)
    else:
        rest = rest[:8] + _numbers(rest[8:], rng)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    return head + text + rest


def _streams(content: bytes, rng: np.random.Generator) -> bytes:
    """A .spz of version 4: streams packed again after their numbers were changed."""
    import zstandard

    (place,) = struct.unpack_from("<I", content, 16)  # of the table of streams
    count = content[15]
    table = [struct.unpack_from("<QQ", content, place + 16 * n) for n in range(count)]
    start, streams = place + 16 * count, []
    for packed, _ in table:
        streams.append(zstandard.decompress(content[start : start + packed]))
        start += packed
    victim = rng.integers(0, count)
    streams[victim] = _numbers(streams[victim], rng)
    packs = [zstandard.compress(stream) for stream in streams]
    sizes = b"".join(struct.pack("<QQ", len(p), len(s)) for p, s in zip(packs, streams, strict=True))
    return content[:place] + sizes + b"".join(packs)


def _words(content: bytes, rng: np.random.Generator) -> bytes:
    """A text, or one with a body after "end_header", whose words are swapped, doubled or extreme."""
    head, mark, body = content.partition(b"end_header\n")
    words = re.split(rb"(\s+|[,;])", head)
    for _ in range(rng.integers(1, 4)):
        place = int(rng.integers(0, len(words)))
        kind = rng.integers(0, 4)
        if kind == 0:
            words[place] = WORDS[rng.integers(0, len(WORDS))]
        elif kind == 1:
            words[place] = words[rng.integers(0, len(words))]
        elif kind == 2:
            words[place:place] = words[place : place + 4]
        else:
            del words[place : place + int(rng.integers(1, 4))]
    return b"".join(words) + mark + (_numbers(body, rng) if body and rng.random() < 0.3 else body)


def _numbers(content: bytes, rng: np.random.Generator) -> bytes:
    """One to three numbers of 1, 2, 4 or 8 bytes become extreme, where they lie aligned."""
    changed = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        width = int(rng.choice([1, 2, 4, 8]))
        room = max(1, min(len(changed), 64 if rng.random() < 0.4 else len(changed)) // width)
        place = width * int(rng.integers(0, room))
        if width == 4 and rng.random() < 0.5:
            with np.errstate(all="ignore"):
                value = np.float32(FLOATS[rng.integers(0, len(FLOATS))]).tobytes()
        else:
            step = int(rng.integers(-2, 3))
            value = (int(rng.choice([0, 1 << (8 * width - 1), 0])) + step) % (1 << (8 * width))
            value = value.to_bytes(width, "little")
        changed[place : place + width] = value
    return bytes(changed)
