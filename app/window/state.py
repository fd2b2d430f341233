"""Everything the window shows, as one frozen value. Commands make the next one; panels read it."""

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from app.window.asking import NO_ASKING, Asking, usable
from app.window.desk import Desk
from app.window.editing import NO_EDITING, Editing
from app.window.poses import START, Pose, Vector

if TYPE_CHECKING:
    from langflash_core.scene.edits import History
    from langflash_core.types import Scene

NEGATIVES = ("object", "things", "stuff", "texture")
FLIGHT_SECONDS = 0.7
TOAST_SECONDS = {"info": 5.0, "error": 20.0}

# Told apart by people with the common colour-vision deficiencies, on dark ground.
PALETTE = (
    (0.96, 0.62, 0.16),
    (0.35, 0.71, 0.98),
    (0.30, 0.80, 0.55),
    (0.94, 0.45, 0.62),
    (0.95, 0.88, 0.35),
    (0.66, 0.55, 0.95),
    (0.88, 0.36, 0.24),
    (0.70, 0.85, 0.82),
)


class Mode(Enum):
    """What the picture shows; the value is the label on its button."""

    RGB = "RGB"
    HEAT = "Heat-map"
    LABELS = "Labels"
    ATOMS = "Atoms"
    DEPTH = "Depth"
    MASKS = "Masks"
    ISOLATE = "Only these"
    HIDE = "Without these"
    DIM = "Dim the rest"
    FEATURES = "Features"
    WEIGHT = "One atom"
    TRANSMITTANCE = "Transmittance"
    COVERAGE = "Coverage"
    AGREEMENT = "Agreement"
    MARGIN = "Margin"

    @property
    def answers(self) -> bool:
        """Whether it shows relevance."""
        return self in _ANSWERING

    @property
    def of_atoms(self) -> bool:
        """Whether it shows weight maps whatever is asked."""
        return self in (Mode.ATOMS, Mode.FEATURES, Mode.WEIGHT)

    def possible(self, info: "SceneInfo | None") -> bool:
        """Whether a scene has what it shows."""
        if info is None or (self in (Mode.WEIGHT, Mode.FEATURES) and info.num_atoms == 0):
            return False
        return bool(info.views) if self is Mode.COVERAGE else self is not Mode.AGREEMENT or info.own_views


_ANSWERING = (Mode.HEAT, Mode.LABELS, Mode.MASKS, Mode.ISOLATE, Mode.HIDE, Mode.DIM, Mode.MARGIN)


@dataclass(frozen=True)
class Photo:
    """A photo in the tray; `problem` is a sentence when it could not be shown.

    fov: the person's own, degrees of the longer side. recorded: what the file says. notes: triage.
    """

    path: Path
    problem: str = ""
    fov: float | None = None
    recorded: float | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Prompt:
    """One phrase. `key` never changes; `score` is None until the view on show is answered.

    threshold: the person's own, or None for the calibrated one. calibrated: what None means.
    like: a language vector as float32 bytes that is asked instead of the words.
    """

    key: int
    text: str = ""
    colour: tuple[float, float, float] = PALETTE[0]
    threshold: float | None = None
    calibrated: float = 0.5
    visible: bool = True
    score: float | None = None
    like: bytes = field(default=b"", repr=False)

    @property
    def found(self) -> bool | None:
        """Whether the view on show holds it; None until it is answered."""
        return None if self.score is None else self.score >= self.cut

    @property
    def cut(self) -> float:
        """The threshold in force."""
        return self.calibrated if self.threshold is None else self.threshold


@dataclass(frozen=True)
class Job:
    """Work under way. done: finished stages with their seconds; started: when `stage` began."""

    title: str
    stage: str = ""
    fraction: float = 0.0
    started: float = 0.0
    done: tuple[tuple[str, float], ...] = ()
    cancelling: bool = False


@dataclass(frozen=True)
class Toast:
    """A message over the picture until `until` (seconds of the session's clock)."""

    key: int
    text: str
    kind: str  # a key of TOAST_SECONDS
    until: float


@dataclass(frozen=True)
class SceneInfo:
    """The scene on show. `scene` is the immutable snapshot; `views` are poses of its photos.

    history: edits that came with it, none of them or those of an earlier session.
    own_views: whether it says which photo made which Gaussian, so that photos can be compared.
    extent: corners (low, high) of the box around nearly all of it, world axes, scene units.
    """

    serial: int
    name: str
    scene: "Scene" = field(compare=False, repr=False)
    views: tuple[Pose, ...]
    num_gaussians: int
    num_atoms: int
    space: str
    warnings: tuple[str, ...] = ()
    path: Path | None = None
    history: "History | None" = field(default=None, compare=False, repr=False)
    own_views: bool = False
    extent: tuple[Vector, Vector] | None = None


@dataclass(frozen=True)
class Flight:
    """A smooth transition between poses, `FLIGHT_SECONDS` long."""

    start: Pose
    end: Pose
    began: float


@dataclass(frozen=True)
class Stats:
    """Figures of the status bar; the session refreshes them every frame."""

    frame_seconds: float = 0.0
    picture_seconds: float = 0.0
    picture_size: tuple[int, int] = (0, 0)
    renderer: str = ""
    depth_range: tuple[float, float] = (0.0, 1.0)
    passes: tuple[tuple[str, int], ...] = ()


NO_STATS = Stats()
NO_DESK = Desk()
FIRST_PROMPT = Prompt(key=0)


@dataclass(frozen=True)
class State:
    """The whole program. now: seconds of the session's clock, set at the start of a frame."""

    now: float = 0.0
    photos: tuple[Photo, ...] = ()
    info: SceneInfo | None = None
    prompts: tuple[Prompt, ...] = (FIRST_PROMPT,)
    active: int = 0
    negatives: tuple[str, ...] = NEGATIVES
    mode: Mode = Mode.RGB
    pose: Pose = START
    flight: Flight | None = None
    view: int | None = None
    job: Job | None = None
    toasts: tuple[Toast, ...] = ()
    next_key: int = 1
    dialog: str | None = None
    dialog_path: str = ""
    stats: Stats = NO_STATS
    editing: Editing = NO_EDITING
    asking: Asking = NO_ASKING
    desk: Desk = NO_DESK
    leaving: bool = False

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
    def wants_maps(self) -> bool:
        """Whether the picture needs the weight maps and not only colour and depth: to show them, or
        for a phrase that has no score yet."""
        waiting = any(prompt.score is None for prompt in self.asked)
        return self.mode.of_atoms or waiting or (self.mode.answers and bool(self.asked))
