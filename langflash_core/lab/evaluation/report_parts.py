"""What a report is made of: tables, plots and sections, before anybody decides how they look."""

import base64
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.lab.evaluation.sights import Sight
from langflash_core.lab.evaluation.tables import Table

JPEG_QUALITY = 82


@dataclass(frozen=True)
class Point:
    """One way of doing it: seconds, an error (less is better), its 95 % interval, and its name."""

    name: str
    seconds: float
    error: float
    bounds: Sequence[float] | None = None


@dataclass(frozen=True)
class Plot:
    """Speed against error."""

    title: str
    across: str
    up: str
    points: Sequence[Point]


@dataclass(frozen=True)
class Shown:
    """A kept sight: pictures side by side in one JPEG, their titles, and numbers; worth: more is better."""

    name: str
    titles: tuple[str, ...]
    numbers: Mapping[str, float]
    worth: float
    strip: bytes
    legend: Mapping[str, Sequence[int]] = field(default_factory=dict)

    @property
    def uri(self) -> str:
        return "data:image/jpeg;base64," + base64.b64encode(self.strip).decode()


@dataclass(frozen=True)
class Section:
    """One set that was judged. about: what it is; result: every number, plain JSON; intervals: by path in
    `result`; scenes: the worst first."""

    name: str
    title: str
    about: str
    result: Mapping[str, Any]
    intervals: Mapping[str, Sequence[float] | None]
    tables: Sequence[Table]
    plots: Sequence[Plot] = ()
    scenes: Sequence[Shown] = field(default_factory=tuple)


class Gallery:
    """Sights of a section, kept as files so that a run that goes on shows those of before as well."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def add(self, sight: Sight) -> None:
        """Keep a sight.

        Raises:
            OutputError: it cannot be written.
        """
        make_folder(self.folder)
        stream = io.BytesIO()
        strip = np.concatenate(list(sight.pictures.values()), axis=1)
        Image.fromarray(strip).save(stream, "JPEG", quality=JPEG_QUALITY)
        write_atomically(self.folder / f"{sight.key}.jpg", stream.getvalue())
        numbers = {
            name: round(float(value), 4) for name, value in sight.numbers.items() if math.isfinite(value)
        }
        document = {
            "name": sight.name,
            "titles": list(sight.pictures),
            "legend": {label: list(colour) for label, colour in sight.legend.items()},
            "numbers": numbers,
            "worth": 0.0 if math.isnan(sight.worth) else float(sight.worth),
        }
        write_atomically(self.folder / f"{sight.key}.sight.json", json.dumps(document).encode())

    def shown(self, keys: Sequence[str], worst: int, best: int) -> list[Shown]:
        """The worst of these, then the best; those without a picture are left out."""
        found = []
        for key in keys:
            try:
                document = json.loads((self.folder / f"{key}.sight.json").read_bytes())
                strip = (self.folder / f"{key}.jpg").read_bytes()
                found.append(
                    Shown(
                        document["name"],
                        tuple(document["titles"]),
                        document["numbers"],
                        document["worth"],
                        strip,
                        document["legend"],
                    )
                )
            except (OSError, ValueError, KeyError, TypeError):
                continue
        found.sort(key=lambda shown: shown.worth)
        return found if len(found) <= worst + best else [*found[:worst], *found[-best:]]
