"""Damaged, cut and lying splat files: one sentence, and no memory that the file does not account for."""

import gzip
import io
import json
import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from langflash_core.export import read
from tests.export.additions import ADDITIONS, additions, axes_file, files_to_add_to, ply_of
from tests.export.additions import outcome as outcome_of_addition
from tests.export.mutations import damages, outcome, whole_files
from tests.export.splats import refusal

ROOM = 8 * 2**20  # bytes that any reader may take, beside twice what the file says it holds


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, bytes]:
    return whole_files(tmp_path_factory.mktemp("whole"))


def refused(path: Path) -> tuple[str, int]:
    """The sentence, and the most memory that Python held."""
    tracemalloc.start()
    try:
        sentence = refusal(lambda: read(path))
        return sentence, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_mutated_splats_are_read_or_refused(files, tmp_path):
    """What else is read is damaged by `tests/torture`, and splats by the thousand."""
    found = set()
    for name, content in damages(files, 20 * len(files), seed=7):
        (tmp_path / name).write_bytes(content)
        found.add(outcome(tmp_path / name))
        (tmp_path / name).write_bytes(files[name])
    assert found == {"read", "refused"}


@pytest.mark.parametrize(
    "name", ["a.compressed.ply", "a.spz", "three.spz", "a.sog", "a.glb", "level2.ksplat"]
)
def test_a_file_cut_anywhere_is_refused(files, tmp_path, name):
    whole = files.get(name)
    if whole is None:
        pytest.skip("needs a package that is not installed")
    path = tmp_path / name
    for end in sorted({*range(64), *np.linspace(64, len(whole) - 1, 60).astype(int)}):
        path.write_bytes(whole[:end])
        sentence, _ = refused(path)
        assert sentence.startswith(name)


def lying(name: str, content: bytes) -> dict[str, bytes]:
    """The same file with a count that it does not hold."""
    if name.endswith(".spz"):
        plain = content if name == "a.spz" else gzip.decompress(content)
        found = {
            f"{count}": plain[:8] + struct.pack("<I", count) + plain[12:] for count in (0, 59, 61, 2**32 - 1)
        }
        return found if name == "a.spz" else {k: gzip.compress(v, 1) for k, v in found.items() if k != "59"}
    if name.endswith(".ksplat"):
        return {
            f"{place} {count}": content[:place] + struct.pack("<I", count) + content[place + 4 :]
            for place in (4, 8, 16, 4096, 4100, 4108, 4128, 4132)
            for count in (2**31, 2**32 - 1)
        }
    return {f"{count}": content.replace(b"vertex 60", b"vertex %d" % count) for count in (0, 59, 61, 10**12)}


@pytest.mark.parametrize("name", ["a.compressed.ply", "a.spz", "three.spz", "level2.ksplat"])
def test_lying_counts_take_no_memory(files, tmp_path, name):
    if name not in files:
        pytest.skip("needs a package that is not installed")
    path = tmp_path / name
    for lie, content in lying(name, files[name]).items():
        path.write_bytes(content)
        sentence, memory = refused(path)
        assert memory < ROOM, (lie, sentence, memory)


def test_a_gzip_bomb_is_unpacked_no_further_than_its_header_says(files, tmp_path):
    """One Gaussian in the header, a gigabyte behind it: read as one Gaussian."""
    plain = gzip.decompress(files["three.spz"])
    one = plain[:8] + struct.pack("<I", 1) + plain[12:]
    packed = io.BytesIO()
    with gzip.open(packed, "wb", 1) as stream:
        stream.write(one)
        for _ in range(1024):
            stream.write(bytes(2**20))
    (tmp_path / "bomb.spz").write_bytes(packed.getvalue())
    tracemalloc.start()
    assert len(read(tmp_path / "bomb.spz").gaussians) == 1
    assert tracemalloc.get_traced_memory()[1] < ROOM + 2 * len(packed.getvalue())
    tracemalloc.stop()


def test_a_zstd_bomb_is_refused(files, tmp_path):
    zstandard = pytest.importorskip("zstandard")
    head, sizes = files["a.spz"][:32], [9 * 60, 60, 180, 180, 240, 60 * 24]
    bomb = zstandard.compress(bytes(2**28))
    table = b"".join(struct.pack("<QQ", len(bomb), size) for size in sizes)
    (tmp_path / "bomb.spz").write_bytes(head + table + bomb * 6)
    sentence, memory = refused(tmp_path / "bomb.spz")
    assert "damaged" in sentence and memory < ROOM


def repacked(content: bytes, **changes: bytes) -> bytes:
    packed = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(content)) as old,
        zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as new,
    ):
        for name in old.namelist():
            new.writestr(name, changes.get(name.partition(".")[0], old.read(name)))
    return packed.getvalue()


def test_sog_bombs_are_refused(files, tmp_path):
    large = io.BytesIO()
    Image.new("RGBA", (8000, 8000)).save(large, "WEBP", lossless=True, method=0)
    meta = json.loads(zipfile.ZipFile(io.BytesIO(files["a.sog"])).read("meta.json"))
    many = json.dumps({**meta, "count": 16383**2}).encode()
    bombs = {
        "pixels": repacked(files["a.sog"], means_l=large.getvalue()),
        "a zip bomb": repacked(files["a.sog"], quats=bytes(2**28)),
        "count": repacked(files["a.sog"], meta=many),
        "elsewhere": repacked(
            files["a.sog"], meta=json.dumps({**meta, "quats": {"files": ["../quats.webp"]}}).encode()
        ),
    }
    for why, content in bombs.items():
        (tmp_path / "bomb.sog").write_bytes(content)
        sentence, memory = refused(tmp_path / "bomb.sog")
        assert "bomb.sog" in sentence and memory < ROOM, why


def test_glb_accessors_that_claim_too_much(files, tmp_path):
    size = struct.unpack_from("<I", files["a.glb"], 12)[0]
    document = json.loads(files["a.glb"][20 : 20 + size])
    for change in (
        lambda d: d["accessors"][0].update(count=10**9),
        lambda d: d["accessors"][2].update(count=61),
        lambda d: d["bufferViews"][0].update(byteLength=10**12),
        lambda d: d["buffers"][0].update(byteLength=10**12),
        lambda d: d["accessors"][3].update(byteOffset=-4),
        lambda d: d["accessors"][0].update(type="VEC2"),
        lambda d: d["nodes"][0].update(children=[0]),
    ):
        changed = json.loads(json.dumps(document))
        change(changed)
        text = json.dumps(changed).encode()
        text += b" " * (-len(text) % 4)
        rest = files["a.glb"][20 + size :]
        head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
        (tmp_path / "lie.glb").write_bytes(head + text + rest)
        sentence, memory = refused(tmp_path / "lie.glb")
        assert memory < ROOM, sentence


@pytest.fixture(scope="module")
def addable(tmp_path_factory) -> tuple[Path, dict[str, bytes], dict]:
    """Where files lie that things are added to, their bytes, and their Gaussians."""
    folder = tmp_path_factory.mktemp("addable")
    files, expected = files_to_add_to(folder), {}
    for name, content in files.items():
        (folder / name).write_bytes(content)
        expected[name] = read(folder / name).gaussians
    return folder, files, expected


@pytest.mark.parametrize("kind", sorted({kind for kind, _ in ADDITIONS}))
def test_what_is_not_known_changes_nothing_or_is_refused_by_name(addable, kind):
    """Six of every addition."""
    folder, files, expected = addable
    if kind not in files:
        pytest.skip("needs a package that is not installed")
    table = [row for row in ADDITIONS if row[0] == kind]
    for name, content, words in additions(files, table, 6 * len(table), seed=5):
        (folder / name).write_bytes(content)
        outcome_of_addition(folder / name, expected[name], words)
    (folder / kind).write_bytes(files[kind])


def test_the_rule_sees_other_numbers_and_words_that_are_missing(addable):
    """Else no addition could be wrong."""
    folder, files, expected = addable
    path = folder / "a.ply"
    moved = bytearray(files["a.ply"])
    moved[-40] ^= 1  # of the last Gaussian's f_dc or f_rest
    path.write_bytes(bytes(moved))
    with pytest.raises(AssertionError, match="are others"):
        outcome_of_addition(path, expected["a.ply"], ())
    path.write_bytes(files["a.ply"].replace(b"float x", b"quad x"))
    with pytest.raises(AssertionError, match="stranger"):
        outcome_of_addition(path, expected["a.ply"], ("stranger",))
    path.write_bytes(files["a.ply"])


def test_axes_behind_a_large_extension_are_found(addable, tmp_path):
    """They turn the scene: a reader that stops before them shows it on its head."""
    _, files, expected = addable
    assert not np.array_equal(expected["axes3.spz"].means, expected["three.spz"].means)
    plain = gzip.decompress(axes_file(files["three.spz"]))
    axes = plain[-12:]
    large = struct.pack("<II", 7, 100_000) + bytes(100_000)
    (tmp_path / "a.spz").write_bytes(gzip.compress(plain[:-12] + large + axes, 1))
    assert np.array_equal(read(tmp_path / "a.spz").gaussians.means, expected["axes3.spz"].means)
    for bad in (struct.pack("<II", 7, 2**31) + axes, struct.pack("<II", 7, 2**21) + bytes(2**21) + axes):
        (tmp_path / "a.spz").write_bytes(gzip.compress(plain[:-12] + bad, 1))
        assert "extension 0x7 of 2" in refused(tmp_path / "a.spz")[0]


def test_an_element_twice_is_refused(files, tmp_path):
    ply = ply_of(files["a.compressed.ply"])
    twice = ply.with_element(0, *ply.elements[0][:2], list(ply.elements[0][2]), ply.bodies[0])
    (tmp_path / "a.compressed.ply").write_bytes(twice.packed())
    assert "two elements chunk" in refused(tmp_path / "a.compressed.ply")[0]
    ply = ply_of(files["a.ply"])
    twice = ply.with_element(0, *ply.elements[0][:2], list(ply.elements[0][2]), bytes(len(ply.bodies[0])))
    (tmp_path / "a.ply").write_bytes(twice.packed())
    assert "two elements vertex" in refused(tmp_path / "a.ply")[0]
