"""Scenes, views and answers out, scenes in: what a file's name ends in says how (`outputs.py`)."""

import os
from pathlib import Path

from langflash_core.base.formats import AXES, kind_of
from langflash_core.base.outputs import OUTPUTS, READERS, import_reference
from langflash_core.errors import InputError, LangFlashError, OutputError, SceneFileError
from langflash_core.types import Frame, QueryResult, Scene

__all__ = ["READERS", "WRITERS", "export", "open_scene", "read"]

_SUBJECTS = {
    "of_scene": (Scene, "a scene"),
    "of_frame": (Frame, "a rendered view"),
    "of_answer": (QueryResult, "an answer"),
}


def _writers() -> dict[str, dict[str, str]]:
    """By ending: what writes a scene, a frame, an answer, under the names of `outputs.Output`."""
    table: dict[str, dict[str, str]] = {}
    for output in OUTPUTS:
        own = {field: writer for field in _SUBJECTS if (writer := getattr(output, field))}
        for ending in output.endings if own else ():
            table.setdefault(ending, {}).update(own)
    return table


WRITERS = _writers()


def export(
    subject: Scene | Frame | QueryResult | Path | str, path: Path | str, *, axes: str | None = None
) -> None:
    """Write `subject` in the format that the suffix of `path` names.

    Args:
        subject: a scene or the path of one, a view, or an answer.
        axes: of a .spz, one of `formats.AXES`, which the file then names; None: the format's own.

    Raises:
        OutputError: unknown suffix, a suffix that cannot hold this subject, or an unwritable path; or axes
            that there are not, or of another file.
        InputError: the subject is nothing that can be written.
    """
    path = Path(path)
    suffix = kind_of(path)
    more = _told_axes(path, axes, OutputError)
    writers = WRITERS.get(suffix)
    if writers is None:
        known = ", ".join(sorted(WRITERS))
        raise OutputError(
            f"cannot write {path.name}: the suffix {suffix or '(none)'} is unknown; use {known}"
        )
    if not isinstance(subject, Frame | QueryResult):
        subject = open_scene(subject)
    field = next(field for field, (kind, _) in _SUBJECTS.items() if isinstance(subject, kind))
    if field in writers:
        return import_reference(writers[field])(subject, path, **more)
    holds = " or ".join(_SUBJECTS[field][1] for field in _SUBJECTS if field in writers)
    fitting = ", ".join(sorted(ending for ending, known in WRITERS.items() if field in known))
    raise OutputError(f"cannot write {path.name}: a {suffix} file holds {holds}; use {fitting}")


def read(path: Path | str, *, axes: str | None = None) -> Scene:
    """Read a scene in the format that the suffix of `path` names.

    Args:
        axes: of a .spz that does not name its own, one of `formats.AXES`; None: the format's own.

    Raises:
        SceneFileError: no such file, unknown suffix, or what the reader finds wrong; or axes that there are
            not, or of another file.
    """
    path = Path(path)
    more = _told_axes(path, axes, SceneFileError)
    reader = READERS.get(kind_of(path), READERS.get(path.suffix.lower()))
    if reader is None and not os.path.exists(path):  # unlike Path, without an error for any name
        raise SceneFileError(f"scene {path} does not exist; check the path")
    if reader is None:
        known = ", ".join(sorted(READERS))
        raise SceneFileError(f"{path.name} is not a scene this program reads; name a file ending in {known}")
    try:
        return import_reference(reader)(path, **more)
    except FileNotFoundError as error:
        raise SceneFileError(f"scene {path} does not exist; check the path") from error
    except OSError as error:
        raise SceneFileError(f"{path} cannot be read ({error.strerror}); check its permissions") from error


def open_scene(scene: Scene | Path | str) -> Scene:
    """A scene as it is, or read from the path that is given instead.

    Raises:
        SceneFileError: as `read`. InputError: it is neither.
    """
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, Path | str):
        return read(scene)
    raise InputError(
        f"this takes a scene or the path of one, not {type(scene).__name__}; "
        "make a scene with reconstruct, or read one with load"
    )


def _told_axes(path: Path, axes: str | None, error: type[LangFlashError]) -> dict[str, str]:
    """What a reader or writer is told of axes."""
    if axes is None:
        return {}
    if kind_of(path) != ".spz":
        raise error(f"{path.name} has its format's axes, which are told of a .spz alone; leave axes out")
    if axes.lower() not in AXES:
        raise error(f"axes {axes} are unknown; use {', '.join(AXES)}")
    return {"axes": axes.lower()}
