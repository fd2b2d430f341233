"""What a good desktop program keeps around its work: preferences, a log, an export under way, the
comparison with a photo, a session to restore. One frozen value inside the state."""

from dataclasses import dataclass
from pathlib import Path

from app.window.export_form import ExportForm
from app.window.preferences import Preferences
from app.window.recovery import Kept

MOST_LINES = 300


@dataclass(frozen=True)
class Line:
    """One line of the log. when: seconds of the session's clock. kind: "info" or "error"."""

    when: float
    kind: str
    text: str


@dataclass(frozen=True)
class Exporting:
    """An export under way. fraction: 0 to 1, below 0 while nothing is known."""

    target: Path
    stage: str = "starting"
    fraction: float = -1.0
    cancelling: bool = False


NO_PREFERENCES = Preferences()
NO_FORM = ExportForm()


@dataclass(frozen=True)
class Desk:
    """compare: where the photo begins, 0 to 1 across the picture; None: not compared. choosing:
    the best pair is being looked for. copy: where a scene that nobody saved is kept. edited,
    selection: copies that an export reads, of the scene with unsaved edits and of what is selected.
    offer: a session that ended badly."""

    preferences: Preferences = NO_PREFERENCES
    lines: tuple[Line, ...] = ()
    form: ExportForm = NO_FORM
    exporting: Exporting | None = None
    compare: float | None = None
    choosing: bool = False
    copy: Path | None = None
    edited: Path | None = None
    selection: Path | None = None
    offer: Kept | None = None
