"""What the program remembers from one day to the next: one small JSON file, written whole.

A file that is damaged, foreign or from another version never stops the start: what cannot be
used falls back to its default, and one sentence says so. Windows share the file: each writes what it has
changed itself, and leaves the rest as the others have kept it.
"""

import json
import os
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from langflash_core.base.detail import DEFAULT_DETAIL, DETAILS
from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.formats import COLOUR_MAPS
from langflash_core.errors import OutputError

from ...places import config_folder
from .locks import one_at_a_time

MOST_RECENT = 10
THEMES = ("dark", "light")
RASTERISERS = ("measured", "quads", "tiles")
"""Ways to draw splats: the one that a trial on the graphics card found to be quicker, or always that one."""
SCALES = (0.75, 2.0)
SPEEDS = (0.2, 5.0)
PANEL_WIDTHS = (300.0, 560.0)  # design pixels
_PLACES = 20_000  # pixels; beyond this a window position is no position


@dataclass(frozen=True)
class Preferences:
    """theme: of THEMES. colormap: of heat-maps. scale: of the interface, on top of the monitor's. speed:
    of flying, a factor. touch_pad: two fingers turn, with Ctrl they zoom. photos_in_space: the cameras'
    frusta are drawn. near_photos: the picture fades, and moves slow down, where no photo looked from
    about there. fill_gaps: it shows what is around its gaps. floor_grid: squares of a metre on the floor.
    start_at_once: dropped photos are reconstructed without asking. detail: of DETAILS, how fine scenes of
    photos are. rasteriser: of RASTERISERS. panel_width: design pixels. window: x, y, width, height in
    screen pixels, or none. dictionary: the same of the dictionary's window inside it, design pixels, and
    whether it is open. recent: newest first. folder: where one was last opened or saved."""

    theme: str = "dark"
    colormap: str = COLOUR_MAPS[0]
    scale: float = 1.0
    speed: float = 1.0
    touch_pad: bool = False
    photos_in_space: bool = False
    near_photos: bool = True
    fill_gaps: bool = True
    floor_grid: bool = False
    start_at_once: bool = True
    detail: str = DEFAULT_DETAIL
    rasteriser: str = RASTERISERS[0]
    panel_width: float = 348.0
    window: tuple[int, ...] = ()
    maximised: bool = False
    dictionary: tuple[int, ...] = ()
    dictionary_open: bool = False
    recent: tuple[str, ...] = ()
    folder: str = ""

    def opened(self, path: Path) -> "Preferences":
        """With `path` as the newest of the recent files."""
        others = [other for other in self.recent if other != str(path)]
        return replace(self, recent=(str(path), *others)[:MOST_RECENT])


DEFAULTS = Preferences()


def file() -> Path:
    """Where they live."""
    return config_folder() / "preferences.json"


def load(path: Path | None = None) -> tuple[Preferences, str]:
    """The preferences, and a sentence when some of them could not be used."""
    path = path or file()
    try:
        return _read(path.read_bytes(), path)
    except FileNotFoundError:
        return DEFAULTS, ""
    except OSError:
        return DEFAULTS, f"The preferences could not be read, so the defaults are used; see {path}."


def _read(stored: bytes, path: Path) -> tuple[Preferences, str]:
    """The same of a file's content."""
    try:
        content = json.loads(stored)
    except (ValueError, RecursionError):
        return DEFAULTS, f"The preferences could not be read, so the defaults are used; see {path}."
    if not isinstance(content, dict):
        return DEFAULTS, f"The preferences file holds something else, so the defaults are used; see {path}."
    known = {field.name for field in fields(Preferences)}
    good: dict[str, Any] = {name: _fitting(name, value) for name, value in content.items() if name in known}
    lost = sorted(name for name, value in good.items() if value is None)
    kept = {name: value for name, value in good.items() if value is not None}
    sentence = f"Some preferences could not be read, so defaults are used: {', '.join(lost)}." if lost else ""
    return Preferences(**kept), sentence


def save(preferences: Preferences, path: Path | None = None, since: Preferences | None = None) -> None:
    """Write them, whole.

    Args:
        since: what this window knew before: what it has not changed since stays as another has kept it. None:
            all is written as it is.

    Raises:
        OutputError: the folder cannot be written, or what another window kept cannot be read.
    """
    path = path or file()
    make_folder(path.parent)
    with one_at_a_time(path.with_suffix(".lock")):
        if since is not None and os.path.exists(path):
            preferences = merged(preferences, since, _kept_by_others(path, preferences))
        write_atomically(path, json.dumps(asdict(preferences), indent=2).encode())


def merged(own: Preferences, since: Preferences, theirs: Preferences) -> Preferences:
    """`theirs`, with what has become of `since` in `own`."""
    changed = {name: value for name, value in asdict(own).items() if value != getattr(since, name)}
    if own.recent and "recent" in changed:
        opened, gone = _opened(own.recent, since.recent), {*since.recent} - {*own.recent}
        others = (path for path in theirs.recent if path not in gone and path not in opened)
        changed["recent"] = (*opened, *others)[:MOST_RECENT]
    return replace(theirs, **changed)


def _opened(own: tuple[str, ...], since: tuple[str, ...]) -> tuple[str, ...]:
    """The first ones of `own`: what follows them stands in `since` in the same order."""
    end = len(since)
    for place in range(len(own) - 1, -1, -1):
        if own[place] not in since[:end]:
            return own[: place + 1]
        end = since.index(own[place])
    return ()


def _kept_by_others(path: Path, own: Preferences) -> Preferences:
    """What lies on the disk; `own` where nothing of it can be used.

    Raises:
        OutputError: the system does not give it, so it is not written over.
    """
    try:
        stored = path.read_bytes()
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(f"cannot read {path}, which other windows also use: {reason}") from error
    theirs, complaint = _read(stored, path)
    return own if complaint and theirs == DEFAULTS else theirs


def try_to_save(preferences: Preferences, since: Preferences | None = None) -> str:
    """Save; a sentence where that failed."""
    try:
        save(preferences, since=since)
    except OutputError as error:
        return f"The preferences could not be saved: {error}."
    return ""


def _fitting(name: str, value: Any) -> Any:
    """The value as its field's type and in its range, or None."""
    default = getattr(DEFAULTS, name)
    if isinstance(default, bool):
        return value if isinstance(value, bool) else None
    if name == "theme":
        return value if value in THEMES else None
    if name == "colormap":
        return value if value in COLOUR_MAPS else None
    if name == "rasteriser":
        return value if value in RASTERISERS else None
    if name == "detail":
        return value if isinstance(value, str) and value in DETAILS else None
    if name == "folder":
        return value if isinstance(value, str) else None
    if isinstance(default, float):
        low, high = {"scale": SCALES, "speed": SPEEDS, "panel_width": PANEL_WIDTHS}[name]
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return float(value) if number and low <= value <= high else None
    if not isinstance(value, list):
        return None
    if name == "recent":
        return tuple(value[:MOST_RECENT]) if all(isinstance(each, str) for each in value) else None
    whole = all(isinstance(each, int) and not isinstance(each, bool) for each in value)
    sides = whole and len(value) == 4 and min(value[2:]) >= 200 and max(map(abs, value)) <= _PLACES
    return tuple(value) if sides or value == [] else None
