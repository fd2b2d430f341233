"""Every reader of ours: small whole files to begin with, and what reads one and looks at what it read."""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from app.window.asking.prompt_sets import read_prompts
from app.window.asking.state import PALETTE, Prompt
from app.window.recovery import preferences, sessions
from app.window.recovery.commands import restored_phrases
from app.window.recovery.state import Kept
from app.window.state import State
from langflash_core.batch.sets import read_sets
from langflash_core.errors import InputError
from langflash_core.export import export, spz
from langflash_core.export.gltf import write_glb
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.report import describe_file
from tests.app.cli.conftest import stripes
from tests.export.mutations import other_files, reader_of, whole_files
from tests.export.splats import random_gaussians


@dataclass(frozen=True)
class Reader:
    """files: names of whole files that lie in the folder. read: a file of such a name; what it raises beside
    `InputError` is a find."""

    name: str
    files: tuple[str, ...]
    read: Callable[[Path], object]


def prepare(folder: Path) -> tuple[dict[str, bytes], list[Reader]]:
    """Whole files in `folder`, and the readers of those that can be made here."""
    files = {**whole_files(folder, 20), **other_files(folder)}
    files |= _more(folder)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    known = [Reader(name, tuple(f for f in own if f in files), read) for name, own, read in READERS]
    return files, [reader for reader in known if reader.files]


def _more(folder: Path) -> dict[str, bytes]:
    """Whole files that the other lists lack."""
    scene = stripes()
    export(scene, folder / "spoken.langflash")
    write_glb(scene, folder / "spoken.glb")
    made = {name: (folder / name).read_bytes() for name in ("spoken.langflash", "spoken.glb", "spoken.ply")}
    spz.write_spz(bare_scene(random_gaussians(20, 0), "made"), folder / "two.spz", version=3)
    made["plain.spz"] = (folder / "two.spz").read_bytes()
    kept = Kept(
        photos=("/p/a.jpg",), fovs=(61.5,), scene="/p/s.langflash", name="kitchen", phrases=("a", "b"),
        likes=("", "00000000"), thresholds=(None, 0.5), colours=((0, 1, 0), (1, 0, 0)), visible=(True, False),
    )  # fmt: skip
    prompts = {
        "format": "langflash prompts", "version": 1, "negatives": ["stuff"],
        "prompts": [{"text": "door", "colour": list(PALETTE[1]), "visible": True, "threshold": 0.5},
                    {"text": Prompt(1).text or "x", "like": "00000000"}],
    }  # fmt: skip
    return made | {
        "session-1.json": json.dumps(sessions.fields(kept)).encode(),
        "preferences.json": json.dumps(asdict(preferences.DEFAULTS)).encode(),
        "a.prompts.json": json.dumps(prompts).encode(),
        "sets.csv": b'name,photos\nhall,in/a.jpg,b.jpg\nden,"c.jpg",\n',
        "semicolons.csv": "\ufeffName;first;second\r\nhall;in/a.jpg;b.jpg\r\nden;c.jpg;\r\n".encode(),
    }


def _posed(path: Path) -> object:
    posed = reader_of(path)()
    return posed.lens() if hasattr(posed, "lens") else posed  # type: ignore[attr-defined]


def _session(path: Path) -> object:
    kept = sessions.read(path)
    return None if kept is None else restored_phrases(State(), kept)


def _described(path: Path) -> object:
    """As `langflash info` does, and as `load` does."""
    with suppress(InputError):
        describe_file(path)
    return reader_of(path)()


def _of(path: Path) -> object:
    return reader_of(path)()


READERS: tuple[tuple[str, tuple[str, ...], Callable[[Path], object]], ...] = (
    ("langflash", ("a.langflash", "spoken.langflash"), _described),
    ("ply", ("a.ply", "spoken.ply"), _of),
    ("compressed", ("a.compressed.ply",), _of),
    ("splat", ("a.splat",), _of),
    ("spz", ("a.spz", "three.spz", "plain.spz"), _of),
    ("sog", ("a.sog",), _of),
    ("ksplat", ("level0.ksplat", "level2.ksplat"), _of),
    ("glb", ("a.glb", "spoken.glb"), _of),
    ("language", ("spoken.language.safetensors",), _of),
    ("transforms", ("transforms.json",), _posed),
    ("colmap", ("cameras.txt", "images.txt"), _posed),
    ("edits", ("a.edits",), _of),
    ("session", ("session-1.json",), _session),
    ("preferences", ("preferences.json",), lambda path: preferences.load(path)),
    ("prompts", ("a.prompts.json",), read_prompts),
    ("camera", ("one.camera.json",), _of),
    ("keys", ("two.keys.json",), _of),
    ("table", ("sets.csv", "semicolons.csv"), lambda path: read_sets(path, path.parent / "out")),
)
