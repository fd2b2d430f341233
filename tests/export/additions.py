"""Splat files with something valid in them that this program need not know: types, elements, flags, versions.

The rule: such a file is read to exactly the Gaussians that it had without, or refused in a sentence that
names what is not known; never to other numbers, and without a warning of numpy. `ADDITIONS` says what is
added to which file of `files_to_add_to`; another format joins by its rows there.
"""

import gzip
import io
import json
import struct
import tempfile
import warnings
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from langflash_core.errors import SceneFileError
from langflash_core.export import export, read
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.container import Container, read_container, write_container
from langflash_core.types import Gaussians
from tests.export.mutations import whole_files
from tests.export.splats import random_gaussians, same

Random = np.random.Generator
Add = Callable[[bytes, Random], tuple[bytes, str]]
"""From a whole file to one with an addition, and a word that a refusal of it must hold."""

_WORDS = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_WORDS |= {"float": "f4", "double": "f8", "half": "f2"}
_UNKNOWN_TYPES = {"int64": 8, "uint64": 8, "bool": 1, "float128": 16, "bfloat16": 2, "string": 4}
_STRANGERS = ("stranger", "f_dc_3", "scale_3", "rot_4", "red", "X", "f_rest", "opacity_2", "filter_2D")
_AXES_EXTENSION = 0xADBE0003


@dataclass(frozen=True)
class Ply:
    """A binary PLY taken apart: lines before the elements, and of each element its lines and its bytes."""

    head: tuple[str, ...]
    elements: tuple[tuple[str, int, tuple[str, ...]], ...]  # name, count, property lines
    bodies: tuple[bytes, ...]

    def packed(self, end: str = "\n") -> bytes:
        lines = list(self.head)
        for name, count, fields in self.elements:
            lines += [f"element {name} {count}", *fields]
        return "".join(line + end for line in (*lines, "end_header")).encode() + b"".join(self.bodies)

    @property
    def order(self) -> str:
        return "<" if any("little" in line for line in self.head) else ">"

    def row(self, index: int, order: str | None = None) -> np.dtype:
        words = (line.split() for line in self.elements[index][2])
        return np.dtype([(name, (order or self.order) + _WORDS[kind]) for _, kind, name in words])

    def place_of(self, name: str) -> int:
        return [element for element, *_ in self.elements].index(name)

    def with_element(self, index: int, name: str, count: int, fields: list[str], body: bytes) -> "Ply":
        """One more at `index`."""
        elements, bodies = list(self.elements), list(self.bodies)
        elements.insert(index, (name, count, tuple(fields)))
        bodies.insert(index, body)
        return Ply(self.head, tuple(elements), tuple(bodies))

    def with_fields(self, index: int, fields: list[str], body: bytes) -> "Ply":
        """Other properties of element `index`."""
        whole = self.with_element(index, *self.elements[index][:2], fields, body)
        return Ply(
            whole.head,
            whole.elements[: index + 1] + whole.elements[index + 2 :],
            whole.bodies[: index + 1] + whole.bodies[index + 2 :],
        )


def ply_of(content: bytes) -> Ply:
    head, _, body = content.partition(b"end_header\n")
    lines = head.decode().splitlines()
    first = next(index for index, line in enumerate(lines) if line.startswith("element"))
    elements: list[tuple[str, int, tuple[str, ...]]] = []
    for line in lines[first:]:
        words = line.split()
        if words[0] == "element":
            elements.append((words[1], int(words[2]), ()))
        elif words[0] == "property":
            name, count, fields = elements[-1]
            elements[-1] = (name, count, (*fields, line))
    whole = Ply(tuple(lines[:first]), tuple(elements), ())
    bodies = []
    for index, (_, count, _) in enumerate(elements):
        size = count * whole.row(index).itemsize
        bodies.append(body[:size])
        body = body[size:]
    return Ply(whole.head, whole.elements, tuple(bodies))


def comment(content: bytes, rng: Random) -> tuple[bytes, str]:
    said = [
        "comment made by a stranger",
        "comment packed_position and f_dc_0 are explained elsewhere",
        "comment element vertex 3",
        "comment property list uchar int vertex_indices",
        "comment end_header",
        "comment gr\xfc\xdfe".encode("latin-1").decode("utf-8", "replace"),
        "obj_info num_cols 640",
        "obj_info is_cyberware_data 1",
        "comment",
        "obj_info",
    ]
    ply = ply_of(content)
    place = int(rng.integers(2, len(ply.head) + 1))
    head = (*ply.head[:place], said[rng.integers(len(said))], *ply.head[place:])
    return Ply(head, ply.elements, ply.bodies).packed(), "comment"


def other_endian(content: bytes, rng: Random) -> tuple[bytes, str]:
    ply = ply_of(content)
    head = tuple(line.replace("binary_little", "binary_big") for line in ply.head)
    bodies = tuple(
        np.frombuffer(body, ply.row(index)).astype(ply.row(index, ">")).tobytes()
        for index, body in enumerate(ply.bodies)
    )
    return Ply(head, ply.elements, bodies).packed(), "big_endian"


def ascii_text(content: bytes, rng: Random) -> tuple[bytes, str]:
    ply = ply_of(content)
    head = tuple(line.replace("binary_little_endian", "ascii") for line in ply.head)
    bodies = tuple(
        "".join(
            " ".join(map(repr, row.tolist())) + "\n" for row in np.frombuffer(body, ply.row(index))
        ).encode()
        for index, body in enumerate(ply.bodies)
    )
    return Ply(head, ply.elements, bodies).packed(), "ascii"


def property_more(content: bytes, rng: Random) -> tuple[bytes, str]:
    """Of a known type or not, anywhere in any element."""
    ply = ply_of(content)
    index = int(rng.integers(len(ply.elements)))
    _, count, fields = ply.elements[index]
    types = {kind: np.dtype(code).itemsize for kind, code in _WORDS.items()} | _UNKNOWN_TYPES
    kind = list(types)[rng.integers(len(types))]
    row, place = ply.row(index), int(rng.integers(len(fields) + 1))
    at = sum(row[field].itemsize for field in (row.names or ())[:place])
    old = np.frombuffer(ply.bodies[index], np.uint8).reshape(count, row.itemsize)
    more = rng.integers(0, 256, (count, types[kind]), np.uint8)
    body = np.concatenate((old[:, :at], more, old[:, at:]), 1).tobytes()
    name = _STRANGERS[rng.integers(len(_STRANGERS))]
    fields = [*fields[:place], f"property {kind} {name}", *fields[place:]]
    return ply.with_fields(index, fields, body).packed(), kind if kind in _UNKNOWN_TYPES else name


def list_among_points(content: bytes, rng: Random) -> tuple[bytes, str]:
    ply = ply_of(content)
    index = ply.place_of("vertex")
    name, count, fields = ply.elements[index]
    old = np.frombuffer(ply.bodies[index], np.uint8).reshape(count, -1)
    body = np.concatenate((old, np.zeros((count, 1), np.uint8)), 1).tobytes()
    return ply.with_fields(index, [*fields, "property list uchar int stranger"], body).packed(), (
        "stranger" if name == "vertex" and "f_dc" in str(fields) else "vertex"
    )


def element_more(content: bytes, rng: Random) -> tuple[bytes, str]:
    """With numbers, with lists, or empty; before, between or after the others."""
    ply = ply_of(content)
    place, count = int(rng.integers(len(ply.elements) + 1)), int(rng.integers(0, 4))
    fields = ["property double one", "property uchar two"]
    body = rng.integers(0, 256, 9 * count, np.uint8).tobytes()
    if rng.random() < 0.4:
        fields, body = ["property list uchar int faces"], b"\2" + bytes(8) if count else b""
        count = min(count, 1)
    return ply.with_element(place, "stranger", count, fields, body).packed(), "stranger"


def other_order(content: bytes, rng: Random) -> tuple[bytes, str]:
    ply = ply_of(content)
    index = int(rng.integers(len(ply.elements)))
    fields, row = ply.elements[index][2], ply.row(index)
    turned = [fields[place] for place in rng.permutation(len(fields))]
    rows = np.frombuffer(ply.bodies[index], row)
    after = np.empty(len(rows), [(line.split()[2], row[line.split()[2]]) for line in turned])
    for name in row.names or ():
        after[name] = rows[name]
    return ply.with_fields(index, turned, after.tobytes()).packed(), "order"


def elements_in_other_order(content: bytes, rng: Random) -> tuple[bytes, str]:
    ply = ply_of(content)
    order = rng.permutation(len(ply.elements))
    elements, bodies = (tuple(some[place] for place in order) for some in (ply.elements, ply.bodies))
    return Ply(ply.head, elements, bodies).packed(), "order"


def other_type(content: bytes, rng: Random) -> tuple[bytes, str]:
    """One property in a type that holds the same numbers, doubles of floats, or words of bytes."""
    ply = ply_of(content)
    index = int(rng.integers(len(ply.elements)))
    fields, row = list(ply.elements[index][2]), ply.row(index)
    place = int(rng.integers(len(fields)))
    _, kind, name = fields[place].split()
    wider = {"float": "double", "uchar": "float", "uint": "double"}.get(kind, kind)
    fields[place] = f"property {wider} {name}"
    rows = np.frombuffer(ply.bodies[index], row)
    types = [(n, row[n] if n != name else ply.order + _WORDS[wider]) for n in row.names or ()]
    return ply.with_fields(index, fields, rows.astype(types).tobytes()).packed(), name


def _unpacked(content: bytes) -> bytes:
    return gzip.decompress(content) if content[:2] == b"\x1f\x8b" else content


def _packed(content: bytes, like: bytes) -> bytes:
    return gzip.compress(content, 1) if like[:2] == b"\x1f\x8b" else content


def spz_flag(content: bytes, rng: Random) -> tuple[bytes, str]:
    plain, bit = bytearray(_unpacked(content)), 1 << int(rng.integers(2, 8))
    plain[14] |= bit
    return _packed(bytes(plain), content), "flag"


def spz_version(content: bytes, rng: Random) -> tuple[bytes, str]:
    plain, version = _unpacked(content), int(rng.choice([0, 5, 6, 255, 2**31]))
    return _packed(plain[:4] + struct.pack("<I", version) + plain[8:], content), f"version {version}"


def spz_streams(content: bytes, rng: Random) -> tuple[bytes, str]:
    """One stream more than its harmonics ask for, or of versions 2 and 3 the spare byte there."""
    plain = bytearray(_unpacked(content))
    plain[15] += 1
    return _packed(bytes(plain), content), "table of contents"


def spz_spare(content: bytes, rng: Random) -> tuple[bytes, str]:
    """The spare bytes of version 4's header; of others bytes behind the last stream."""
    if content[:2] == b"\x1f\x8b":
        return _packed(_unpacked(content) + rng.integers(0, 256, 40, np.uint8).tobytes(), content), "behind"
    return content[:20] + rng.integers(0, 256, 12, np.uint8).tobytes() + content[32:], "spare"


def _extended(content: bytes, more: bytes) -> bytes:
    """With extension records before those that there are."""
    plain = bytearray(_unpacked(content))
    plain[14] |= 2
    if content[:2] == b"\x1f\x8b":
        count, degree, version = *struct.unpack_from("<I", plain, 8), plain[12], plain[4]
        end = 16 + count * (16 + (3 if version == 2 else 4) + 3 * ((degree + 1) ** 2 - 1))
        return _packed(bytes(plain[:end]) + more + bytes(plain[end:]), content)
    table = struct.unpack_from("<I", plain, 16)[0]
    plain[16:20] = struct.pack("<I", table + len(more))
    return bytes(plain[:32]) + more + bytes(plain[32:])


def spz_extension(content: bytes, rng: Random) -> tuple[bytes, str]:
    size = int(rng.choice([0, 4, 40, 5000, 200_000]))
    record = struct.pack("<II", 0xADBE0777, size) + rng.integers(0, 256, size, np.uint8).tobytes()
    return _extended(content, record), "extension"


def spz_axes(content: bytes, rng: Random) -> tuple[bytes, str]:
    """Axes that no version of the format names."""
    number = int(rng.choice([0, 17, 255, 2**31]))
    return _extended(content, struct.pack("<III", _AXES_EXTENSION, 4, number)), f"axes {number}"


def axes_file(content: bytes) -> bytes:
    """The same .spz with the axes LUF named."""
    return _extended(content, struct.pack("<III", _AXES_EXTENSION, 4, 7))


def _entries(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _zipped(entries: dict[str, bytes], packing: int = zipfile.ZIP_STORED, said: bytes = b"") -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", packing) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
        archive.comment = said
    return packed.getvalue()


def _of_meta(change: Callable[[dict, Random], str]) -> Add:
    def add(content: bytes, rng: Random) -> tuple[bytes, str]:
        entries = _entries(content)
        meta = json.loads(entries["meta.json"])
        word = change(meta, rng)
        return _zipped(entries | {"meta.json": json.dumps(meta).encode()}), word

    add.__name__ = change.__name__
    return add


@_of_meta
def sog_key(meta: dict, rng: Random) -> str:
    parts = [meta, *(part for part in meta.values() if isinstance(part, dict))]
    values = [1, "stranger", None, [1.5], {"files": ["stranger.webp"]}, {"count": 3, "codebook": []}]
    parts[rng.integers(len(parts))]["stranger"] = values[rng.integers(len(values))]
    return "stranger"


@_of_meta
def sog_version(meta: dict, rng: Random) -> str:
    meta["version"] = [3, 1, "2", 2.5, None, [2]][rng.integers(6)]
    return f"version {meta['version']!r}"


@_of_meta
def sog_encoding(meta: dict, rng: Random) -> str:
    part = ["means", "scales", "quats", "sh0"][rng.integers(4)]
    meta[part]["files"] = [*meta[part]["files"], "stranger.webp"]
    return "stranger"


@_of_meta
def sog_bands(meta: dict, rng: Random) -> str:
    meta["shN"]["bands"] = [4, 5, "2", 2.5][rng.integers(4)]
    return f"degree {meta['shN']['bands']!r}"


def sog_file(content: bytes, rng: Random) -> tuple[bytes, str]:
    packing = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)[rng.integers(2)]
    return _zipped({"stranger.webp": b"RIFF", **_entries(content)}, packing, b"a stranger"), "stranger"


def ksplat_version(content: bytes, rng: Random) -> tuple[bytes, str]:
    major, minor = ((0, 2), (0, 9), (1, 0), (1, 1), (0, 0))[rng.integers(5)]
    return bytes([major, minor]) + content[2:], f"version {major}.{minor}"


def ksplat_level(content: bytes, rng: Random) -> tuple[bytes, str]:
    level = int(rng.integers(3, 9))
    return content[:20] + struct.pack("<H", level) + content[22:], f"compressed {level}"


def ksplat_spare(content: bytes, rng: Random) -> tuple[bytes, str]:
    """What the headers leave unsaid: bytes that no reader knows."""
    changed, noise = bytearray(content), rng.integers(0, 256, 4096, np.uint8).tobytes()
    changed[2:4], changed[12:16], changed[22:36], changed[44:4096] = (
        noise[:2],
        noise[2:6],
        noise[6:20],
        noise[44:],
    )
    changed[4096 + 44 : 4096 + 1024] = noise[:980]
    return bytes(changed), "header"


def ksplat_room(content: bytes, rng: Random) -> tuple[bytes, str]:
    """Room for more sections than there are."""
    more = int(rng.integers(1, 4))
    changed = bytearray(content[:5120] + bytes(1024 * more) + content[5120:])
    changed[4:8] = struct.pack("<I", 1 + more)
    return bytes(changed), "section"


def ksplat_degree(content: bytes, rng: Random) -> tuple[bytes, str]:
    return content[: 4096 + 40] + struct.pack("<H", 4) + content[4096 + 42 :], "degree 4"


def scene_key(content: bytes, rng: Random) -> tuple[bytes, str]:
    return _changed_scene(content, lambda found: (dict(found.metadata, stranger={"a": [1]}), found.arrays))


def scene_tensor(content: bytes, rng: Random) -> tuple[bytes, str]:
    more = rng.normal(size=(int(rng.integers(1, 5)), 3)).astype(np.float32)
    return _changed_scene(content, lambda found: (found.metadata, dict(found.arrays, stranger=more)))


def scene_version(content: bytes, rng: Random) -> tuple[bytes, str]:
    return _changed_scene(content, lambda found: (found.metadata, found.arrays), version=9)


def _changed_scene(content: bytes, change, version: int | None = None) -> tuple[bytes, str]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.langflash"
        path.write_bytes(content)
        found = read_container(path)
        metadata, arrays = change(found)
        write_container(
            Container(version or found.version, found.space, found.view_size, metadata, arrays), path
        )
        return path.read_bytes(), "stranger" if version is None else f"format {version}"


def header_line(content: bytes, rng: Random) -> tuple[bytes, str]:
    ply = ply_of(content)
    return Ply((*ply.head, "extension stranger 1"), ply.elements, ply.bodies).packed(), "extension stranger"


def newline_after(content: bytes, rng: Random) -> tuple[bytes, str]:
    return content + b"\n", "found"


_PLY = (
    comment, header_line, newline_after, other_endian, ascii_text, property_more,
    list_among_points, element_more, other_order, elements_in_other_order, other_type,
    lambda content, rng: (ply_of(content).packed("\r\n"), "header"),
    lambda content, rng: (ply_of(content).packed("\t \n"), "header"),
    lambda content, rng: (content.replace(b"endian 1.0", b"endian 1.7", 1), "1.7"),
)  # fmt: skip
_SPZ = (spz_flag, spz_version, spz_streams, spz_spare, spz_extension)
_SOG = (sog_key, sog_version, sog_encoding, sog_bands, sog_file)
_KSPLAT = (ksplat_version, ksplat_level, ksplat_spare, ksplat_room, ksplat_degree)
_BY_KIND: dict[str, tuple[Add, ...]] = {
    "a.ply": _PLY,
    "a.compressed.ply": _PLY,
    "a.spz": (*_SPZ, spz_axes),
    "three.spz": (*_SPZ, spz_axes),
    "two.spz": _SPZ,
    "axes.spz": _SPZ,
    "axes3.spz": _SPZ,
    "a.splat": (newline_after,),
    "a.sog": _SOG,
    "level0.ksplat": _KSPLAT,
    "level1.ksplat": _KSPLAT,
    "level2.ksplat": _KSPLAT,
    "a.langflash": (scene_key, scene_tensor, scene_version),
}
ADDITIONS: list[tuple[str, Add]] = [(kind, add) for kind, adds in _BY_KIND.items() for add in adds]
"""(name of a file of `files_to_add_to`, what adds something to it)."""


def files_to_add_to(folder: Path) -> dict[str, bytes]:
    """A small whole file of every kind, by name; packages that are absent leave theirs out."""
    from langflash_core.export.spz import write_spz
    from tests.export.splats import ksplat_bytes

    files = whole_files(folder)
    files["level1.ksplat"] = ksplat_bytes(random_gaussians(700, 1), 1)
    write_spz(bare_scene(random_gaussians(60, 2), "made"), folder / "two.spz", version=2)
    files["two.spz"] = (folder / "two.spz").read_bytes()
    files["axes3.spz"] = axes_file(files["three.spz"])
    if "a.spz" in files:
        files["axes.spz"] = axes_file(files["a.spz"])
    export(bare_scene(random_gaussians(60, 2), "made"), folder / "a.langflash")
    return files


def additions(
    files: dict[str, bytes], table: list[tuple[str, Add]], count: int, seed: int
) -> Iterator[tuple[str, bytes, tuple[str, ...]]]:
    """Name, content and the words of which a refusal holds one: each row of the table in turn."""
    rng = np.random.default_rng(seed)
    there = [(kind, add) for kind, add in table if kind in files]
    for index in range(count):
        kind, add = there[index % len(there)]
        content, word = add(files[kind], rng)
        yield kind, content, (word,)


def outcome(path: Path, expected: Gaussians, words: tuple[str, ...]) -> str:
    """ "read" or "refused".

    Raises:
        AssertionError: the rule is broken. Whatever a reader lets through, warnings among it.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = read(path).gaussians
    except SceneFileError as error:
        sentence = str(error)
        assert "\n" not in sentence and len(sentence) < 500 and "; " in sentence, sentence
        assert any(word in sentence for word in words), (words, sentence)
        return "refused"
    assert same(expected, found), "its numbers are others"
    return "read"
