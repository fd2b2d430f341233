"""Small whole files of every kind, their readers, and damage: scenes of all formats, language beside a .ply,
edits, photos, poses, camera files and key frames.

Bytes are flipped, overwritten with extreme numbers, cut, doubled or mixed with those of another file; a
packed payload is damaged inside its wrapping too, where checksums would otherwise hide its readers.
`tests/torture/fuzz.py` does so by the thousand.
"""

import gzip
import io
import json
import struct
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pillow_heif
from PIL import Image

from langflash_core.errors import InputError, OutputError
from langflash_core.export import export, read
from langflash_core.export.cameras import read_posed
from langflash_core.geometry.tours import along
from langflash_core.images.decode import read_photo
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.checks import check_scene
from langflash_core.scene.edits import History, Marks, Mask, hide, rename_atom
from langflash_core.scene.edits_file import load_history, save_history
from langflash_core.types import Scene
from langflash_core.writing.cameras import read_camera
from langflash_core.writing.films import read_key_frames
from tests.app.cli.conftest import stripes
from tests.export.splats import ksplat_bytes, random_gaussians

EXTREMES = [0, 1, 0xFF, 0x7F, 0xFFFFFFFF, 0x7FFFFFFF, 0x80000000, 1 << 24, 0xFFFF]
PHOTOS = (".jpg", ".png", ".webp", ".tiff", ".gif", ".bmp", ".ppm", ".avif", ".heic")
JSONS = ("a.edits", "one.camera.json", "two.keys.json", "transforms.json")


def whole_files(folder: Path, count: int = 60) -> dict[str, bytes]:
    """A small whole file of every kind, by name; those that need a package which is absent are left out."""
    scene = bare_scene(random_gaussians(count, 2), "made")
    files = {}
    for name in ("a.ply", "a.compressed.ply", "a.splat", "a.spz", "a.sog", "a.glb", "a.usda", "a.langflash"):
        try:
            export(scene, folder / name)
        except OutputError:
            continue
        files[name] = (folder / name).read_bytes()
    from langflash_core.export import spz

    spz.write_spz(scene, folder / "three.spz", version=3)
    files["three.spz"] = (folder / "three.spz").read_bytes()
    for level in (0, 2):
        files[f"level{level}.ksplat"] = ksplat_bytes(random_gaussians(700, 1), level)
    return files


def other_files(folder: Path) -> dict[str, bytes]:
    """What is read besides splats: a small whole file of every kind, by name, with what belongs to it."""
    scene = stripes()
    ys, xs = np.mgrid[:48, :64]
    pixels = np.stack((4 * xs, 5 * ys, xs + ys), -1).astype(np.uint8)
    photo = Image.fromarray(pixels)
    names = ["a.jpg", "a.png", "a.webp", "a.tiff", "a.gif", "a.bmp", "a.ppm", "a.avif"]
    for name in names:
        photo.save(folder / name)
    Image.fromarray(pixels[..., 0].astype(np.uint16) * 257).save(folder / "deep.png")
    pillow_heif.from_pillow(photo).save(folder / "a.heic")
    export(scene, folder / "spoken.ply")
    marks = Marks.without_edits(len(scene.gaussians), scene.semantics.num_atoms)
    history = History(marks).edited("hide", hide(marks, Mask.of(scene.gaussians.means[:, 0].numpy() > 0)))
    history = history.edited("rename", rename_atom(history.marks, 0, "seat"))
    save_history(history.undo(), scene, {"name": "made"}, folder / "a.edits")
    posed = replace(scene, photos=((folder / "a.jpg").read_bytes(),) * 2)
    posed = posed.with_record(photos=("left.jpg", "right.jpg"))
    export(posed, folder / "transforms.json")
    export(posed, folder / "cameras.txt")
    views = [
        {"viewmat": scene.viewmats[v].tolist(), "K": scene.Ks[v].tolist(), "width": 56, "height": 42}
        for v in range(2)
    ]
    (folder / "one.camera.json").write_text(json.dumps(views[0]))
    (folder / "two.keys.json").write_text(json.dumps(views))
    names += ["deep.png", "a.heic", "spoken.language.safetensors", *JSONS, "cameras.txt", "images.txt"]
    return {name: (folder / name).read_bytes() for name in names}


def mutated(content: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    """One to four damages."""
    damaged = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        size = max(1, len(damaged))
        # Headers decide most, so half of the damage goes there.
        place = int(rng.integers(0, min(size, 400) if rng.random() < 0.5 else size))
        kind = rng.integers(0, 6)
        if kind == 0:
            damaged[place : place + 1] = bytes([rng.integers(0, 256)])
        elif kind == 1:
            damaged[place : place + 4] = struct.pack("<I", EXTREMES[rng.integers(0, len(EXTREMES))])
        elif kind == 2:
            damaged = damaged[:place]
        elif kind == 3:
            damaged[place:place] = damaged[place : place + int(rng.integers(1, 200))]
        elif kind == 4:
            damaged[place : place + int(rng.integers(1, 300))] = b""
        else:
            damaged[place : place + 64] = other[place : place + 64]
    return bytes(damaged)


def damaged_inside(name: str, content: bytes, other: bytes, rng: np.random.Generator) -> bytes:
    """Damage below the wrapping of a packed file; others as `mutated`."""
    if name in JSONS:
        return json.dumps(lied(json.loads(content), rng)).encode()
    if name == "three.spz":
        return gzip.compress(mutated(gzip.decompress(content), other, rng), 1)
    if not name.endswith((".sog", ".npz")):
        return mutated(content, other, rng)
    packed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(packed, "w") as new:
        victim = old.namelist()[rng.integers(0, len(old.namelist()))]
        for entry in old.namelist():
            inner = old.read(entry)
            if entry == "meta.json" and rng.random() < 0.5:
                inner = json.dumps(lied(json.loads(inner), rng)).encode()
            new.writestr(entry, mutated(inner, other, rng) if entry == victim else inner)
    return packed.getvalue()


def lied(meta, rng: np.random.Generator):
    """One value of a document replaced by one that it should not have."""
    wrong = [None, -1, 10**12, 1.5, float("inf"), float("nan"), "x", [], {}, [1e308] * 3, ["../meta.json"]]
    path, here = [], meta
    while isinstance(here, dict | list) and here and (not path or rng.random() < 0.8):
        key = list(here)[rng.integers(0, len(here))] if isinstance(here, dict) else rng.integers(0, len(here))
        path.append(key)
        here = here[key]
    inner = meta
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = wrong[rng.integers(0, len(wrong))]
    return meta


def damages(files: dict[str, bytes], count: int, seed: int) -> Iterator[tuple[str, bytes]]:
    rng = np.random.default_rng(seed)
    names = list(files)
    for index in range(count):
        name, other = names[index % len(names)], files[names[rng.integers(0, len(names))]]
        change = damaged_inside if rng.random() < 0.4 else lambda _, *rest: mutated(*rest)
        yield name, change(name, files[name], other, rng)


def outcome(path: Path) -> str:
    """ "read" or "refused".

    Raises:
        AssertionError: what was read is not whole, or the sentence is none. Whatever a reader lets through.
    """
    try:
        reader_of(path)()
    except InputError as error:
        sentence = str(error)
        assert "\n" not in sentence and len(sentence) < 500, sentence
        assert "; " in sentence or path.name in sentence, sentence
        return "refused"
    return "read"


@cache
def _edited() -> Scene:
    """Made once: it asks the language model, which takes longer than reading."""
    return stripes()


def reader_of(path: Path) -> Callable[[], object]:
    """What reads a file of this name, and looks at what it read."""
    name = path.name
    if name in ("transforms.json", "cameras.txt", "images.txt"):
        return lambda: read_posed(path.with_name("cameras.txt") if name == "images.txt" else path)
    if name == "a.edits":
        return lambda: load_history(path, _edited())
    if name == "one.camera.json":
        return lambda: read_camera(path)
    if name == "two.keys.json":
        return lambda: along(*read_key_frames(path, None), (16, 12))
    if path.suffix in PHOTOS:
        return lambda: read_photo(path).image.load()
    scene = path.with_name("spoken.ply") if name.endswith(".language.safetensors") else path
    return lambda: check_scene(read(scene))
