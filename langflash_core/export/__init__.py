"""Scenes and answers out: one table from what a file's name ends in to what writes (or reads) it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export import (
    cameras,
    coco,
    compressed_ply,
    glb,
    gltf,
    html,
    ksplat,
    npz,
    ply,
    png,
    sog,
    splat,
    spz,
    usd,
)
from langflash_core.formats import COMPRESSED_PLY, PAGE_OUT, SOG_FOLDER, USD, kind_of
from langflash_core.scene.file import load, save
from langflash_core.types import Frame, QueryResult, Scene

__all__ = ["READERS", "WRITERS", "Writer", "export", "read"]


@dataclass(frozen=True)
class Writer:
    """`write(subject, path)` for subjects of one type; `what` names that type for people."""

    subject: type
    what: str
    write: Callable[..., None]


WRITERS: dict[str, tuple[Writer, ...]] = {
    ".langflash": (Writer(Scene, "a scene", save),),
    ".png": (
        Writer(Frame, "a rendered view", png.write_frame),
        Writer(QueryResult, "an answer", png.write_answer),
    ),
    ".npz": (Writer(QueryResult, "an answer", npz.write_npz),),
    ".json": (Writer(QueryResult, "an answer", coco.write_answer),),
    ".ply": (Writer(Scene, "a scene", ply.write_ply),),
    COMPRESSED_PLY: (Writer(Scene, "a scene", compressed_ply.write_compressed_ply),),
    ".splat": (Writer(Scene, "a scene", splat.write_splat),),
    ".spz": (Writer(Scene, "a scene", spz.write_spz),),
    ".sog": (Writer(Scene, "a scene", sog.write_sog),),
    SOG_FOLDER: (Writer(Scene, "a scene", sog.write_sog),),
    ".glb": (
        Writer(Scene, "a scene", gltf.write_glb),
        Writer(QueryResult, "an answer", glb.write_answer),
    ),
    PAGE_OUT: (Writer(Scene, "a scene", html.write_html),),
    cameras.COLMAP: (Writer(Scene, "a scene", cameras.write_colmap),),
    cameras.TRANSFORMS: (Writer(Scene, "a scene", cameras.write_transforms),),
    **{suffix: (Writer(Scene, "a scene", usd.write_usd),) for suffix in USD},
}


def _read_any_ply(path: Path) -> Scene:
    """A .ply by what its header declares, whatever stands before the suffix."""
    packed = compressed_ply.is_compressed(path)
    return compressed_ply.read_compressed_ply(path) if packed else ply.read_ply(path)


READERS: dict[str, Callable[[Path], Scene]] = {
    ".langflash": load,
    ".ply": _read_any_ply,
    ".splat": splat.read_splat,
    ".spz": spz.read_spz,
    ".sog": sog.read_sog,
    SOG_FOLDER: sog.read_sog,
    ".ksplat": ksplat.read_ksplat,
    ".glb": gltf.read_gltf,
    ".gltf": gltf.read_gltf,
    **dict.fromkeys(USD, usd.read_usd),
}


def export(subject: Scene | Frame | QueryResult, path: Path | str) -> None:
    """Write `subject` in the format that the suffix of `path` names.

    Raises:
        OutputError: unknown suffix, a suffix that cannot hold this subject, or an unwritable path.
    """
    path = Path(path)
    suffix = kind_of(path)
    writers = WRITERS.get(suffix)
    if writers is None:
        known = ", ".join(sorted(WRITERS))
        raise OutputError(
            f"cannot write {path.name}: the suffix {suffix or '(none)'} is unknown; use {known}"
        )
    for writer in writers:
        if isinstance(subject, writer.subject):
            return writer.write(subject, path)
    holds = " or ".join(writer.what for writer in writers)
    fitting = ", ".join(
        s for s, ws in sorted(WRITERS.items()) if any(isinstance(subject, w.subject) for w in ws)
    )
    raise OutputError(f"cannot write {path.name}: a {suffix} file holds {holds}; use {fitting}")


def read(path: Path | str) -> Scene:
    """Read a scene in the format that the suffix of `path` names.

    Raises:
        SceneFileError: unknown suffix, or what the reader finds wrong.
    """
    path = Path(path)
    reader = READERS.get(kind_of(path), READERS.get(path.suffix.lower()))
    if reader is None:
        known = ", ".join(sorted(READERS))
        raise SceneFileError(f"{path.name} is not a scene this program reads; name a file ending in {known}")
    try:
        return reader(path)
    except FileNotFoundError as error:
        raise SceneFileError(f"scene {path} does not exist; check the path") from error
    except OSError as error:
        raise SceneFileError(f"{path} cannot be read ({error.strerror}); check its permissions") from error
