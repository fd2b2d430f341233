"""A history of edits as JSON: small, readable, whole or refused.

    {"format": "langflash-edits", "version": 4, "digest": of the scene, "gaussians": N, "atoms": K,
     "about": {...}, "done": [...], "undone": [...]}

An edit is {"label", "flips": {mask: base64 of zlib}, "swaps": [[atom, [into, name, on, denied...], [...]]]},
where key frames or the scale changed with "told": [[name, before, after]], where Gaussians were moved or
recoloured with "changes": [stayed, [went], [came]], each of those [kind, base64 of zlib, numbers].
What came before the first edit of "done" is in "before": edits without a name, from the scene to the marks
that its history began with and on to those that can still be undone to; "forgotten" counts the latter.
Version 1 had neither "changes" nor "before", version 2 no tours, version 3 no worlds and names of things; who
reads only that must not lose them in silence.
"""

import base64
import hashlib
import json
import math
import zlib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from langflash_core.base.files import write_atomically
from langflash_core.base.limits import TEXT
from langflash_core.base.records import World, world_from_json, world_to_json
from langflash_core.errors import SceneFileError
from langflash_core.scene.changes import Change, encode_change, parse_change
from langflash_core.scene.edited import first_marks
from langflash_core.scene.edits import MASKS, TOLD, Atom, Edit, History, difference
from langflash_core.scene.mask import Mask
from langflash_core.scene.tour import read_tour, told_tour
from langflash_core.types import Scene

FORMAT, VERSION = "langflash-edits", 4


def scene_digest(scene: Scene) -> str:
    """Names a scene by what edits are about: its means and dictionary, which files keep exactly."""
    total = hashlib.sha256(f"{len(scene.gaussians)} {tuple(scene.semantics.dictionary.shape)}".encode())
    for values in (scene.gaussians.means, scene.semantics.dictionary):
        total.update(values.detach().cpu().float().contiguous().numpy().tobytes())
    return total.hexdigest()


def save_history(history: History, scene: Scene, about: dict, path: Path) -> None:
    """Write a history of edits of a scene; `about` holds plain JSON values of the caller's own.

    Raises:
        OutputError: the path cannot be written.
    """
    marks, oldest = (first_marks(scene), history.first), history.moved_to(0).marks
    content = {
        "format": FORMAT,
        "version": VERSION,
        "digest": scene_digest(scene),
        "gaussians": history.marks.deleted.count,
        "atoms": len(history.marks.atoms),
        "about": about,
        "done": [_encode_edit(edit) for edit in history.done],
        "undone": [_encode_edit(edit) for edit in history.undone],
        "before": [_encode_edit(difference("", *marks)), _encode_edit(difference("", history.first, oldest))],
        "forgotten": history.forgotten,
    }
    write_atomically(path, json.dumps(content).encode())


def read_about(path: Path) -> tuple[str, dict, int]:
    """The digest of the scene that a file's edits are about, what `about` held, and how many are done.

    Raises:
        SceneFileError: as `load_history`.
    """
    content = _read_json(path)
    return content["digest"], content["about"], len(content["done"])


def load_history(path: Path, scene: Scene) -> History:
    """The history in a file, over the scene that it is about.

    Raises:
        SceneFileError: missing, damaged, or about another scene.
    """
    content = _read_json(path)
    if content["digest"] != scene_digest(scene):
        raise SceneFileError(f"{path.name} holds edits of another scene; open the scene they were made in")
    try:
        count = len(scene.gaussians)
        done, undone, before = (
            tuple(_decode_edit(entry, count) for entry in content.get(part, ()))
            for part in ("done", "undone", "before")
        )
        _check_there((*done, *undone, *before), scene)
        passed = [first_marks(scene)]
        for edit in before:
            passed.append(edit.apply(passed[-1]))
        forgotten = max(int(content.get("forgotten", 0)), 0)
        opened = passed[min(len(before), 1)] if forgotten else None
        start = History(passed[-1], (), tuple(reversed(done)), forgotten, opened)
        whole = replace(start.moved_to(len(done)), undone=undone)
        whole.moved_to(len(done) + len(undone))  # what can be redone must fit as well
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, zlib.error) as error:
        raise SceneFileError(
            f"{path.name} is damaged ({_error_line(error)}); edit the scene again"
        ) from error
    return whole


def _error_line(error: Exception) -> str:
    """One short line: what a file holds may have many, and errors repeat it."""
    return " ".join(str(error).split())[:100]


def _check_there(edits: Iterable[Edit], scene: Scene) -> None:
    """Raises ValueError: what a merge brought is not in the scene."""
    most = len(scene.gaussians), scene.semantics.num_atoms
    for there in (there for edit in edits for name, *pair in edit.told if name == "there" for there in pair):
        if there[0] > most[0] or there[1] > most[1]:
            raise ValueError(f"there: expected at most {most[0]} Gaussians and {most[1]} atoms")


def _encode_edit(edit: Edit) -> dict:
    encoded = {
        "label": edit.label,
        "flips": {name: base64.b64encode(packed).decode() for name, packed in edit.flips},
        "swaps": [[k, *([a.into, a.name, a.on, *a.denied] for a in pair)] for k, *pair in edit.swaps],
    }
    if edit.told:
        encoded["told"] = [[name, *map(_plain, pair)] for name, *pair in edit.told]
    if edit.changes is not None:
        stayed, *both = edit.changes
        encoded["changes"] = [stayed, *([_encoded_change(each) for each in some] for some in both)]
    return encoded


def _plain(value: Any) -> Any:
    """A told value as JSON has it."""
    return world_to_json(value) if isinstance(value, World) else value


def _encoded_change(change: Change) -> list:
    kind, numbers = encode_change(change)
    return [kind, base64.b64encode(zlib.compress(change.rows.bits, 1)).decode(), numbers]


def _decoded_change(count: int, kind: str, packed: str, numbers: list) -> Change:
    bits = zlib.decompress(base64.b64decode(packed, validate=True))
    if len(bits) != -(-count // 8):
        raise ValueError(f"changes: expected a scene of {8 * len(bits)} rows, received {count}")
    return parse_change(kind, Mask(count, bits), numbers)


def _decode_edit(entry: dict, count: int) -> Edit:
    flips = tuple((name, base64.b64decode(packed, validate=True)) for name, packed in entry["flips"].items())
    if any(name not in MASKS for name, _ in flips):
        raise ValueError(f"flips: expected {', '.join(MASKS)}, received {', '.join(entry['flips'])}")
    swaps = tuple((int(k), _atom(*before), _atom(*after)) for k, before, after in entry["swaps"])
    values = tuple(
        (name, *(_decode_value(name, value) for value in pair)) for name, *pair in entry.get("told", ())
    )
    changes = None
    if "changes" in entry:
        stayed, *both = entry["changes"]
        went, came = (tuple(_decoded_change(count, *each) for each in some) for some in both)
        changes = int(stayed), went, came
    return Edit(str(entry["label"]), flips, swaps, values, changes)


def _decode_value(name: str, value: Any) -> Any:
    """A value as `Marks` hold it."""
    match name, value:
        case "camera_path", [*keys] if all(isinstance(key, dict) for key in keys):
            return tuple(keys)
        case "metric_scale", None:
            return None
        case "metric_scale", (int() | float()) as metres if math.isfinite(metres) and metres > 0:
            return float(metres)
        case "tour", dict():
            return told_tour(read_tour(value))
        case "world", None:
            return None
        case "world", dict():
            return world_from_json(value)
        case "thing_names", dict() if all(isinstance(word, str) for word in value.values()):
            return dict(value)
        case "there", [int() as num_gaussians, int() as num_atoms] if min(num_gaussians, num_atoms) >= 0:
            return num_gaussians, num_atoms
    raise ValueError(f"told: expected a value of {' or '.join(TOLD)}, received {name} {value!r}")


def _atom(into: int, name: str, on: bool, *denied: str) -> Atom:
    return Atom(int(into), str(name), bool(on), tuple(map(str, denied)))


def _read_json(path: Path) -> dict:
    try:
        TEXT.check(path.stat().st_size, path.name, SceneFileError)
        content = json.loads(path.read_bytes())
        if content["format"] != FORMAT or not isinstance(content["about"], dict):
            raise ValueError("it is no file of edits")
        if int(content["version"]) > VERSION:
            raise SceneFileError(f"{path.name} was written by a newer LangFlash; update LangFlash")
        if not all(isinstance(content[part], list) for part in ("done", "undone")):
            raise ValueError("its edits are no lists")
        content["digest"] = str(content["digest"])
    except FileNotFoundError as error:
        raise SceneFileError(f"{path} does not exist; check the path") from error
    except OSError as error:
        raise SceneFileError(f"{path} cannot be read ({error.strerror}); check its permissions") from error
    except (ValueError, LookupError, TypeError, ArithmeticError, RecursionError) as error:
        raise SceneFileError(
            f"{path.name} is damaged ({_error_line(error)}); edit the scene again"
        ) from error
    return content
