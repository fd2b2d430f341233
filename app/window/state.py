"""Everything the window shows, as one frozen value. Commands make the next one; panels read it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from langflash_core import pictures
from langflash_core.colormaps import HeatColours
from langflash_core.geometry.poses import START, Pose
from langflash_core.pictures import Picture

from .asking.state import FIRST_PROMPT, NO_ASKING, Asking, Prompt, usable
from .editing.state import NO_EDITING, Editing
from .exporting.state import NO_EXPORTING, Exporting
from .filming.state import Tour, read
from .opening.state import NO_OPENING, Opening
from .recovery.preferences import DEFAULTS, Preferences
from .recovery.state import NO_RECOVERY, Recovery
from .scene.state import Flight, Job, Photo, Room, SceneInfo

TOAST_SECONDS = {"info": 5.0, "error": 20.0}
MOST_LINES = 300


@dataclass(frozen=True)
class Toast:
    """A message over the picture until `until` (seconds of the session's clock)."""

    key: int
    text: str
    kind: str  # a key of TOAST_SECONDS
    until: float


@dataclass(frozen=True)
class Line:
    """One line of the log. when: seconds of the session's clock. kind: "info" or "error"."""

    when: float
    kind: str
    text: str


@dataclass(frozen=True)
class Stats:
    """Figures of the status bar; the session refreshes them every frame. settling: a finer picture than the
    one on show is being drawn. failing: it could not be, and is tried again."""

    frame_seconds: float = 0.0
    picture_seconds: float = 0.0
    picture_size: tuple[int, int] = (0, 0)
    renderer: str = ""
    depth_range: tuple[float, float] = (0.0, 1.0)
    passes: tuple[tuple[str, int], ...] = ()
    settling: bool = False
    failing: bool = False


NO_STATS = Stats()


@dataclass(frozen=True)
class Palette:
    """The command palette: what is typed there, and which of the commands that fit is chosen."""

    text: str = ""
    place: int = 0


NO_PALETTE = Palette()


@dataclass(frozen=True)
class State:
    """The whole program.

    now: seconds of the session's clock, set at the start of a frame. aside: photos of the scene on show while
    those of a new room are in the tray. choosing: the best pair is being looked
    for. tour: a flight along the key frames. view: of the photo stood at, if any. compare: where the photo
    begins, 0 to 1 across the picture; None: not compared. negatives: the person's own; none: those of the
    scene. lines: the log, oldest first. rooms: scenes that were on show before, the last one first. dropped:
    photos while it is asked where they belong. pending: commands that wait for an answer about unsaved edits.
    """

    now: float = 0.0
    photos: tuple[Photo, ...] = ()
    aside: tuple[Photo, ...] | None = None
    choosing: bool = False
    info: SceneInfo | None = None
    rooms: tuple[Room, ...] = ()
    dropped: tuple[Path, ...] = ()
    pending: tuple[Any, ...] = ()
    prompts: tuple[Prompt, ...] = (FIRST_PROMPT,)
    active: int = 0
    negatives: tuple[str, ...] = ()
    mode: Picture = pictures.RGB
    pose: Pose = START
    flight: Flight | None = None
    tour: Tour | None = None
    view: int | None = None
    compare: float | None = None
    job: Job | None = None
    toasts: tuple[Toast, ...] = ()
    next_key: int = 1
    dialog: str | None = None
    dialog_path: str = ""
    palette: Palette = NO_PALETTE
    stats: Stats = NO_STATS
    editing: Editing = NO_EDITING
    asking: Asking = NO_ASKING
    exporting: Exporting = NO_EXPORTING
    opening: Opening = NO_OPENING
    recovery: Recovery = NO_RECOVERY
    preferences: Preferences = DEFAULTS
    lines: tuple[Line, ...] = ()
    leaving: bool = False

    @property
    def keys(self) -> tuple[Pose, ...]:
        """Key frames of the camera's path."""
        return read(self.editing.marks.camera_path) if self.editing.marks else ()

    @property
    def metric(self) -> float | None:
        """Metres per scene unit, where that is known."""
        return self.editing.marks.metric_scale if self.editing.marks else None

    @property
    def asked(self) -> tuple[Prompt, ...]:
        """Prompts to answer: visible ones that say something whole."""
        return tuple(p for p in self.prompts if p.visible and usable(p.text))

    @property
    def active_prompt(self) -> Prompt | None:
        """The prompt whose heat-map is on show: the active one, or else the first that is asked."""
        asked = self.asked
        return next((p for p in asked if p.key == self.active), asked[0] if asked else None)

    @property
    def heat_colours(self) -> HeatColours:
        """How heat-maps are coloured, here and in files."""
        return HeatColours(self.preferences.colormap, self.asking.span)

    @property
    def wants_maps(self) -> bool:
        """Whether the picture needs the weight maps and not only colour and depth: to show them, or
        for a phrase that has no score yet."""
        waiting = any(prompt.score is None for prompt in self.asked)
        return self.mode.maps or waiting or (self.mode.answers and bool(self.asked))
