"""What a run collects scene by scene: added up, kept on disk, and read again.

A tally is a dataclass of lists (joined), dictionaries (their values added), tensors and numbers (added).
Kept as one JSON file a scene, so that a run that was ended goes on where it stopped, and intervals can be
drawn over scenes.
"""

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import Tensor

from langflash_core import __version__
from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.resources import asset_path
from langflash_core.base.running import Progress
from langflash_core.errors import InputError
from langflash_core.lab.evaluation.intervals import bootstrap
from langflash_core.lab.evaluation.metrics import PoseError, Presence
from langflash_core.lab.evaluation.segments import ClassQuality, Panoptic
from langflash_core.lab.training.measures import nan_mean
from langflash_core.language.leads import FILE as LEADS
from langflash_core.network import PRESETS
from langflash_core.network.checkpoints.store import part_folder

Item = TypeVar("Item")
MEASURES = 5
"""Raised whenever a measure changes, so that what was kept before is judged anew."""
_VALUES: dict[str, type] = {kind.__name__: kind for kind in (PoseError, Presence, ClassQuality, Panoptic)}
_TYPES = {str(kind): kind for kind in (torch.int64, torch.float32, torch.float64, torch.bool)}


def merged(tallies: Sequence[Item]) -> Item:
    """One tally of several, in order.

    Raises:
        ValueError: there is none.
    """
    if not tallies:
        raise ValueError("tallies: expected at least one, received none")
    kind = type(tallies[0])
    assert is_dataclass(kind)
    return kind(**{f.name: _sum([getattr(t, f.name) for t in tallies]) for f in fields(kind)})  # type: ignore[return-value]


def _sum(values: Sequence[Any]) -> Any:
    first = values[0]
    if isinstance(first, list):
        return [entry for value in values for entry in value]
    if isinstance(first, dict):
        keys = dict.fromkeys(key for value in values for key in value)
        return {key: _sum([value[key] for value in values if key in value]) for key in keys}
    if isinstance(first, tuple):
        return tuple(map(sum, zip(*values, strict=True)))
    total = first
    for value in values[1:]:
        total = total + value
    return total


def plain(value: Any) -> Any:
    """A tally, or what is in one, as JSON can hold it; `revived` is the way back."""
    if isinstance(value, Tensor):
        places = value.nonzero()
        return {
            "of": "tensor",
            "type": str(value.dtype),
            "shape": list(value.shape),
            "places": places.tolist(),
            "values": plain(value[tuple(places.T)].tolist()),
        }
    if is_dataclass(value) and not isinstance(value, type):
        entries = {f.name: plain(getattr(value, f.name)) for f in fields(value)}
        return {"of": type(value).__name__, "fields": entries}
    if isinstance(value, dict):
        return {"of": "dict", "entries": [[plain(key), plain(entry)] for key, entry in value.items()]}
    if isinstance(value, tuple):
        return {"of": "tuple", "entries": [plain(entry) for entry in value]}
    if isinstance(value, list):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return {"of": "float", "text": str(value)}
    return value


def revived(document: Any, kinds: Mapping[str, type]) -> Any:
    """What `plain` was given.

    Args:
        kinds: dataclasses that may occur besides those of `metrics` and `segments`, by name.

    Raises:
        ValueError, KeyError, TypeError: the document is something else.
    """
    if isinstance(document, list):
        return [revived(entry, kinds) for entry in document]
    if not isinstance(document, dict):
        return document
    match document["of"]:
        case "tensor":
            tensor = torch.zeros(document["shape"], dtype=_TYPES[document["type"]])
            if document["places"]:
                places = torch.tensor(document["places"])
                tensor[tuple(places.T)] = torch.tensor(revived(document["values"], {}), dtype=tensor.dtype)
            return tensor
        case "dict":
            return {revived(key, kinds): revived(entry, kinds) for key, entry in document["entries"]}
        case "tuple":
            return tuple(revived(entry, kinds) for entry in document["entries"])
        case "float":
            return float(document["text"])
        case name:
            kind = {**_VALUES, **kinds}[name]
            return kind(**{key: revived(entry, kinds) for key, entry in document["fields"].items()})


@dataclass(frozen=True)
class Shelf:
    """A folder of kept tallies, `name`.json each; `key`: what must be the same for one to be used again."""

    folder: Path
    key: Mapping[str, object]
    kind: type

    def read(self, name: str) -> Any | None:
        """The tally of a scene; None where there is none, or one that was made otherwise."""
        try:
            document = json.loads((self.folder / f"{name}.json").read_bytes())
            if document["key"] != json.loads(json.dumps(self._stamped())):
                return None
            return revived(document["tally"], {self.kind.__name__: self.kind})
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def write(self, name: str, tally: Any) -> None:
        """Keep a tally.

        Raises:
            OutputError: it cannot be written.
        """
        make_folder(self.folder)
        document = {"key": self._stamped(), "tally": plain(tally)}
        write_atomically(self.folder / f"{name}.json", json.dumps(document, allow_nan=False).encode())

    def _stamped(self) -> dict[str, object]:
        return {"langflash": __version__, "measures": MEASURES, **self.key}


def identity(weights: Path | None, preset: str) -> str:
    """Which weights a tally was made with: the digest of the file named or shipped, or of those installed,
    and of what phrases start with."""
    shipped = asset_path("weights") / f"{preset}.safetensors"
    paths = [weights] if weights is not None else [shipped] if shipped.is_file() else []
    paths = paths or sorted(part_folder(PRESETS[preset]).glob("*.safetensors"))
    total = hashlib.sha256(preset.encode())
    for path in (*paths, asset_path(LEADS)):
        with path.open("rb") as stream:
            total.update(hashlib.file_digest(stream, "sha256").digest())
    return total.hexdigest()[:16]


@dataclass
class Noted:
    """Numbers per case, by name: what tallies begin with."""

    numbers: dict[str, list[float]] = field(default_factory=dict)

    def note(self, **values: float) -> None:
        for name, value in values.items():
            self.numbers.setdefault(name, []).append(float(value))

    def means(self) -> dict[str, float]:
        return {name: nan_mean(values) for name, values in self.numbers.items()}

    def median(self, name: str) -> float:
        return float(torch.tensor(self.numbers[name]).nanmedian())


@dataclass
class Rows:
    """What judges without pixels to count say: a row of plain JSON a case."""

    rows: list[dict] = field(default_factory=list)


def judged(
    cases: Iterable[tuple[str, Item]],
    judge: Callable[[Item, Progress], Any],
    *,
    count: int | None = None,
    shelf: Shelf | None = None,
    progress: Progress = lambda stage, fraction: None,
) -> dict[str, Any]:
    """Tallies of cases by their names, in order; those on the shelf are not judged again.

    Args:
        judge: is given a case, and a progress of its own. count: of the cases, for the progress.

    Raises:
        InputError: there is no case.
    """
    found: dict[str, Any] = {}
    for name, case in cases:

        def told(stage: str, fraction: float, name: str = name) -> None:
            progress(f"{name}: {stage}", (len(found) + fraction) / count if count else 0.0)

        told(f"{len(found) + 1} of {count or 'some'}", 0.0)
        tally = None if shelf is None else shelf.read(name)
        if tally is None:
            tally = judge(case, told)
            if shelf is not None:
                shelf.write(name, tally)
        found[name] = tally
    if not found:
        raise InputError("there is nothing to judge; give a source that holds at least one scene")
    return found


def numbers_of(document: Mapping[str, Any], before: str = "") -> dict[str, float]:
    """Every number of a nested result by its path ("measures/psnr"); null is NaN, lists are left out."""
    found: dict[str, float] = {}
    for key, value in document.items():
        path = f"{before}{key}"
        if isinstance(value, Mapping):
            found |= numbers_of(value, f"{path}/")
        elif value is None or (isinstance(value, int | float) and not isinstance(value, bool)):
            found[path] = math.nan if value is None else float(value)
    return found


def intervals(
    tallies: Sequence[Item], summary: Callable[[Item], Mapping[str, Any]], *, draws: int = 300
) -> dict[str, list[float] | None]:
    """Where each number of a summary lies in 95 % of draws of scenes, by the paths of `numbers_of`; None:
    unknown."""
    found = bootstrap(tallies, lambda chosen: numbers_of(summary(merged(chosen))), draws=draws)
    return {
        name: None if math.isnan(low) or math.isnan(high) else [round(low, 4), round(high, 4)]
        for name, (low, high) in found.items()
    }
