"""Every reader of ours: small whole files to begin with, and what reads one and looks at what it read."""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from app.window.asking.prompt_sets import read_prompts
from app.window.asking.state import PALETTE, Prompt
from app.window.recovery import preferences, records
from app.window.recovery.commands import restored_phrases
from app.window.recovery.state import Kept
from app.window.state import State
from langflash_core.base.keeping import Keep
from langflash_core.base.phrases import read_phrases
from langflash_core.batch.sets import read_sets
from langflash_core.errors import InputError, SceneFileError
from langflash_core.export import export, spz
from langflash_core.export.gltf import write_glb
from langflash_core.geometry.poses import Pose, Vector
from langflash_core.language.lessons import Lesson, Lessons, read_lessons, write_lessons
from langflash_core.mending.recipes import Recipe, load_recipe, save_recipe
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.report import describe_file
from langflash_core.scene.tour import Note, Stop, Tour, read_tour, told_tour
from tests.app.cli.conftest import stripes
from tests.export.mutations import PHOTOS, other_files, reader_of, whole_files
from tests.export.splats import random_gaussians

STEP = "step-1.kept.npz"


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
        "session-1.json": records.told(kept),
        "preferences.json": json.dumps(asdict(preferences.DEFAULTS)).encode(),
        **_written(folder),
        "a.prompts.json": json.dumps(prompts).encode(),
        "sets.csv": b'name,photos\nhall,in/a.jpg,b.jpg\nden,"c.jpg",\n',
        "semicolons.csv": "\ufeffName;first;second\r\nhall;in/a.jpg;b.jpg\r\nden;c.jpg;\r\n".encode(),
    }


def _written(folder: Path) -> dict[str, bytes]:
    """A vocabulary, a recipe, phrases, a tour by itself and in a scene, a step of unfinished work."""
    tour = Tour(
        (Stop("door", Pose(), "come in", "plant"), Stop("desk", Pose(fov=40.0))),
        (Note("wide", Vector(0, 0, 1), Vector(1, 0, 1)), Note("old", Vector(1, 2, 3), phrase="wall")),
        "desk",
    )  # fmt: skip
    vector = np.full(4, 0.5, np.float32)
    lessons = (Lesson(vector, "Oma's chair", ("sofa",)), Lesson(-vector, "", ("door", "wall")))
    write_lessons(Lessons("f00d", lessons), folder / "a.words.json")
    rules = ({"opacity": (None, 0.1), "size": (0.2, None)}, {"colour": (0.5, 0.5, 0.5, 0.1)})
    box = (-1.0, -1.0, -1.0, 1.0, 1.0, 1.0)
    save_recipe(Recipe(0.5, rules=rules, within=("chair",), crop=box), folder / "a.recipe.json")
    export(stripes().with_record(tour=told_tour(tour)), folder / "told.langflash")
    Keep(folder, "1")("step", lambda: {"depth": np.ones((3, 4), np.float32), "view": np.arange(2)})
    names = ("a.words.json", "a.recipe.json", "told.langflash", STEP)
    return {name: (folder / name).read_bytes() for name in names} | {
        "phrases.txt": "# the kitchen\nchair\n\nOma’s chair\nplant\n".encode(),
        "a.tour.json": json.dumps(told_tour(tour)).encode(),
    }


def _toured(path: Path) -> object:
    """As the record of a scene is read."""
    try:
        tour = read_tour(json.loads(path.read_bytes()))
    except ValueError as error:
        raise SceneFileError(f"{path.name} is damaged ({error})") from error
    assert read_tour(told_tour(tour)) == tour
    return tour


def _kept_step(path: Path) -> object:
    """What cannot be read is made again, whatever is wrong with it."""
    return Keep(path.parent, "1")("step", lambda: {"depth": np.zeros(1)})


def _posed(path: Path) -> object:
    posed = reader_of(path)()
    return posed.upright() if hasattr(posed, "upright") else posed  # type: ignore[attr-defined]


def _session(path: Path) -> object:
    kept = records.read(path)
    return None if kept is None else restored_phrases(State(), kept)


def _described(path: Path) -> object:
    """As `langflash info` does, and as `load` does."""
    with suppress(InputError):
        describe_file(path)
    return reader_of(path)()


def _of(path: Path) -> object:
    return reader_of(path)()


READERS: tuple[tuple[str, tuple[str, ...], Callable[[Path], object]], ...] = (
    ("langflash", ("a.langflash", "spoken.langflash", "told.langflash"), _described),
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
    ("photo", (*(f"a{suffix}" for suffix in PHOTOS), "deep.png"), _of),
    ("session", ("session-1.json",), _session),
    ("preferences", ("preferences.json",), lambda path: preferences.load(path)),
    ("prompts", ("a.prompts.json",), read_prompts),
    ("camera", ("one.camera.json",), _of),
    ("keys", ("two.keys.json",), _of),
    ("table", ("sets.csv", "semicolons.csv"), lambda path: read_sets(path, path.parent / "out")),
    ("vocabulary", ("a.words.json",), read_lessons),
    ("recipe", ("a.recipe.json",), load_recipe),
    ("phrases", ("phrases.txt",), read_phrases),
    ("tour", ("a.tour.json",), _toured),
    ("unfinished", (STEP,), _kept_step),
)
