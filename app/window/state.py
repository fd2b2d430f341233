"""Everything the window shows, as one frozen value. Commands make the next one; panels read it."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from langflash_core.base.colormaps import HeatColours
from langflash_core.base.records import Guess, World
from langflash_core.geometry import rotations
from langflash_core.geometry.poses import UP, Pose
from langflash_core.scene.tour import NO_TOUR, read_tour
from langflash_core.scene.tour import Tour as ToldTour

from .asking.state import NO_ASKING, Asking
from .dialogs import Dialog
from .editing.state import NO_EDITING, Editing
from .exporting.state import NO_EXPORTING, Exporting
from .filming.state import NO_FILMING, Filming, read
from .inventory.state import NO_LISTING, Listing
from .opening.state import NO_OPENING, Opening
from .recovery.preferences import DEFAULTS, Preferences
from .recovery.state import NO_RECOVERY, Recovery
from .scene.drops import NOT_TYPED, Typed
from .scene.state import NO_SCENE, Showing
from .touring.state import NO_TOURING, Touring

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
    one on show is being drawn. failing: it could not be, and is tried again. memory: the most bytes that
    were held so far, 0 where the system does not say."""

    frame_seconds: float = 0.0
    picture_seconds: float = 0.0
    picture_size: tuple[int, int] = (0, 0)
    renderer: str = ""
    depth_range: tuple[float, float] = (0.0, 1.0)
    passes: tuple[tuple[str, int], ...] = ()
    settling: bool = False
    failing: bool = False
    memory: int = 0


NO_STATS = Stats()


@dataclass(frozen=True)
class Palette:
    """The command palette: what is typed there, and which of the commands that fit is chosen."""

    text: str = ""
    place: int = 0


NO_PALETTE = Palette()


@dataclass(frozen=True)
class State:
    """The whole program: what belongs to no feature, and of every feature its half.

    now: seconds of the session's clock, set at the start of a frame. next_key: of a toast or a prompt. typed:
    in the open dialog's field for a path. lines: the log, oldest first.
    """

    now: float = 0.0
    next_key: int = 1
    dialog: Dialog | None = None
    typed: Typed = NOT_TYPED
    palette: Palette = NO_PALETTE
    toasts: tuple[Toast, ...] = ()
    lines: tuple[Line, ...] = ()
    stats: Stats = NO_STATS
    leaving: bool = False
    preferences: Preferences = DEFAULTS
    scene: Showing = NO_SCENE
    asking: Asking = NO_ASKING
    editing: Editing = NO_EDITING
    filming: Filming = NO_FILMING
    exporting: Exporting = NO_EXPORTING
    opening: Opening = NO_OPENING
    recovery: Recovery = NO_RECOVERY
    touring: Touring = NO_TOURING
    listing: Listing = NO_LISTING

    # The state with another half; `changes` are that half's fields

    def with_scene(self, **changes: Any) -> "State":
        return replace(self, scene=replace(self.scene, **changes))

    def with_asking(self, **changes: Any) -> "State":
        return replace(self, asking=replace(self.asking, **changes))

    def with_editing(self, **changes: Any) -> "State":
        return replace(self, editing=replace(self.editing, **changes))

    def with_filming(self, **changes: Any) -> "State":
        return replace(self, filming=replace(self.filming, **changes))

    def with_exporting(self, **changes: Any) -> "State":
        return replace(self, exporting=replace(self.exporting, **changes))

    def with_opening(self, **changes: Any) -> "State":
        return replace(self, opening=replace(self.opening, **changes))

    def with_recovery(self, **changes: Any) -> "State":
        return replace(self, recovery=replace(self.recovery, **changes))

    def with_touring(self, **changes: Any) -> "State":
        return replace(self, touring=replace(self.touring, **changes))

    def with_listing(self, **changes: Any) -> "State":
        return replace(self, listing=replace(self.listing, **changes))

    # What follows from several halves

    @property
    def keys(self) -> tuple[Pose, ...]:
        """Key frames of the camera's path."""
        return read(self.editing.marks.camera_path) if self.editing.marks else ()

    @property
    def tour(self) -> ToldTour:
        """Stops and notes of the scene on show."""
        return read_tour(self.editing.marks.tour) if self.editing.marks else NO_TOUR

    @property
    def shows_notes(self) -> bool:
        """Whether notes are drawn on the picture: while the tour's panel is open or a tour plays."""
        return self.scene.info is not None and (self.touring.open or self.filming.tour is not None)

    @property
    def metric(self) -> float | None:
        """Metres per scene unit, where that is known."""
        return self.editing.marks.metric_scale if self.editing.marks else None

    @property
    def guess(self) -> Guess | None:
        """Of metres per scene unit, where nobody told."""
        return None if self.metric is not None or self.world is None else self.world.guess

    @property
    def world(self) -> World | None:
        """Where the scene stands, where somebody looked."""
        return self.editing.marks.world if self.editing.marks else None

    @property
    def turn(self) -> Float[np.ndarray, "3 3"]:
        """Rows east, down and north of where the scene stands, in its own axes; those where nobody looked."""
        return np.eye(3) if self.world is None else rotations.matrix(self.world.turn)

    @property
    def up(self) -> Float[np.ndarray, "3"]:
        """Up, unit, in the scene's own axes."""
        return UP if self.world is None else -self.turn[1]

    @property
    def heat_colours(self) -> HeatColours:
        """How heat-maps are coloured, here and in files."""
        return HeatColours(self.preferences.colormap, self.asking.span)

    @property
    def wants_maps(self) -> bool:
        """Whether the picture needs the weight maps and not only colour and depth: to show them, or
        for a phrase that has no score yet."""
        asked, mode = self.asking.asked, self.scene.mode
        waiting = any(prompt.score is None for prompt in asked)
        return mode.maps or waiting or (mode.answers and bool(asked))
