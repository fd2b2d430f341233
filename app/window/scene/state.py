"""The photos in the tray, the scene made of them, and what of it the picture shows."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from langflash_core.base import pictures
from langflash_core.base.pictures import Picture
from langflash_core.base.records import FoundLens
from langflash_core.geometry.poses import START, Pose, Vector
from langflash_core.scene.edits import History, Marks

from ..protocol import Command
from .memory import SceneMemory

if TYPE_CHECKING:
    from langflash_core.scene.above import Above
    from langflash_core.types import Scene


FLIGHT_SECONDS = 0.7
INSISTING = 150.0
"""Design pixels that a drag goes in vain until it may go where no photo saw anything: an eighth of a window
of 1280, more than a hand overshoots."""
WHOLE_PHOTOS = 32  # of a scene, up to which all stay whole on the graphics card: 1.4 MB each
ABOVE = "from above"
"""The picture of the map."""
WHOLE = "compared photo"
"""The picture of the one that is whole of more photos."""
MOST_ROOMS = 3  # beside the one on show; a large scene takes 100 MB


def possible(picture: Picture, info: "SceneInfo | None") -> bool:
    """Whether a scene has what a picture shows."""
    if info is None:
        return False
    has = {"atoms": info.num_atoms > 0, "photos": bool(info.views), "owners": info.own_views}
    return has.get(picture.needs, True)


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
class TakenOut:
    """The tray before photos were taken out of it. left: those that stayed. history: the scene's edits by
    then. before: the same of what was taken out earlier."""

    photos: tuple[Photo, ...]
    left: tuple[Path, ...]
    history: "History | None" = field(default=None, compare=False, repr=False)
    before: "TakenOut | None" = field(default=None, repr=False)


PAUSED = "Paused. Resume continues from here, even after you quit and open the same photos again."
RECONSTRUCTING, RESTORING = "Reconstructing", "Restoring"
"""Titles of the jobs that make a scene out of the tray, and out of what an earlier session kept."""

MOMENTS = 3.0
"""Seconds in which who cancels what was resumed takes that back, and not what was done before."""

LOOKING_THROUGH = "film"
"""The one stage of looking through a film, as the core calls it: what remains of it can be told."""

_SAID = {
    LOOKING_THROUGH: "looking through the film",
    "photos": "opening photos",
    "weights": "loading the network",
    "network": "reading photos",
    "encoder": "reading photos",
    "language features": "naming things",
    "grouping": "grouping surfaces",
    "aggregation": "naming each group",
    "depth": "measuring depth",
    "poses": "finding the cameras",
    "point maps": "measuring depth",
    "refinement": "sharpening surfaces",
    "Gaussians": "placing Gaussians",
    "assemble": "putting it together",
    "light": "matching the light",
    "elements": "covering surfaces",
    "colours": "matching colours",
    "prune": "tidying up",
    "level": "finding the floor",
}


def said(stage: str) -> str:
    """A stage of the reconstruction as people would say it; others are called as they are."""
    head = head_of(stage)
    return _SAID.get(head, head) + stage[len(head) :]


def head_of(stage: str) -> str:
    """A stage without the photo that it is at."""
    return stage.partition(": ")[0]


@dataclass(frozen=True)
class Job:
    """Work under way. done: finished stages with their seconds; started: when `stage` began. pausable: what
    is done of it is kept; pausing: it is to stop and stay so. resumed: it goes on from what was kept."""

    title: str
    stage: str = ""
    fraction: float = 0.0
    started: float = 0.0
    done: tuple[tuple[str, float], ...] = ()
    cancelling: bool = False
    pausable: bool = False
    pausing: bool = False
    resumed: bool = False

    def age(self, now: float) -> float:
        """Seconds since it began."""
        return now - self.started + sum(seconds for _, seconds in self.done)


@dataclass(frozen=True)
class SceneInfo:
    """The scene on show. `scene` is the immutable snapshot; `views` are poses of its photos.

    history: edits that came with it, none of them or those of an earlier session.
    memory: of what was computed about it last; goes on with the same scene.
    own_views: whether it says which photo made which Gaussian, so that photos can be compared.
    extent: corners (low, high) of the box around nearly all of it, world axes, scene units. above: the map.
    lenses: those that its photos told. doubts: of photos that do not look right what is wrong and what helps.
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
    above: "Above | None" = field(default=None, compare=False, repr=False)
    lenses: tuple[FoundLens, ...] = ()
    doubts: Mapping[int, str] = field(default_factory=dict, compare=False)
    memory: SceneMemory = field(default=None, compare=False, repr=False)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.memory is None or self.memory.scene is not self.scene:
            object.__setattr__(self, "memory", SceneMemory(self.scene))


@dataclass(frozen=True)
class Room:
    """A scene that was on show, as it was left: its photos, its edits, where one stood. unhidden,
    shown_by: as in `Showing`."""

    info: SceneInfo
    photos: tuple[Photo, ...] = ()
    history: "History | None" = field(default=None, compare=False, repr=False)
    saved: Marks | None = field(default=None, compare=False, repr=False)
    pose: Pose = START
    unhidden: "Room | None" = field(default=None, compare=False, repr=False)
    shown_by: tuple[Path, ...] = ()

    @property
    def edited(self) -> bool:
        """Whether it has edits."""
        return self.history is not None and bool(self.history.done or self.history.undone)


@dataclass(frozen=True)
class Flight:
    """A smooth transition between poses, `FLIGHT_SECONDS` long."""

    start: Pose
    end: Pose
    began: float


@dataclass(frozen=True)
class Hold:
    """A hand that drags on the picture. looks: it turns on the spot, as it does where a photo was taken.
    pivot: of the scene, what it turns around; None: what the pose looks at. refused: design pixels that it
    went in vain, for no photo saw anything there."""

    looks: bool = False
    pivot: Vector | None = None
    refused: float = 0.0

    @property
    def insists(self) -> bool:
        """Whether it went on for so long that it may go where no photo saw anything."""
        return self.refused > INSISTING


@dataclass(frozen=True)
class Showing:
    """The scene's half of the state: the tray, the scene on show, how it is looked at, the work on it.

    aside: photos of the scene on show while those of a new room are in the tray. choosing: the best pair is
    being looked for. rooms: scenes that were on show before, the last one first. dropped: photos, or a scene,
    while it is asked where they belong. pending: commands that wait for an answer about unsaved edits. view:
    of the photo stood at, if any. hold: the hand on the picture. compare: where the photo begins, 0 to 1
    across the picture; None: not compared.
    unfinished: photos on which work was begun and kept. taken_out: what the tray had before.
    unhidden: the scene on show as it was before something in it was hidden for good, until that is saved;
    shown_by: files of scenes that show what was hidden in it by then. mute: the scene on show as it was
    before it was taught phrases.
    """

    photos: tuple[Photo, ...] = ()
    aside: tuple[Photo, ...] | None = None
    choosing: bool = False
    info: SceneInfo | None = None
    rooms: tuple[Room, ...] = ()
    dropped: tuple[Path, ...] = ()
    pending: tuple[Command, ...] = ()
    mode: Picture = pictures.RGB
    pose: Pose = START
    flight: Flight | None = None
    view: int | None = None
    hold: Hold | None = None
    compare: float | None = None
    unhidden: Room | None = None
    shown_by: tuple[Path, ...] = ()
    mute: Room | None = None
    job: Job | None = None
    unfinished: tuple[Path, ...] = ()
    taken_out: TakenOut | None = None

    @property
    def paths(self) -> tuple[Path, ...]:
        """Of the photos in the tray."""
        return tuple(photo.path for photo in self.photos)

    @property
    def num_taken_out(self) -> int:
        """Photos that were taken out of the tray and can be put back: nothing was done to it since."""
        taken = self.taken_out
        if taken is None or self.job is not None or {*self.paths} != {*taken.left}:
            return 0
        return len(taken.photos) - len(taken.left)

    @property
    def goes_on(self) -> bool:
        """Whether work on the photos in the tray goes on from where it was."""
        return bool(self.unfinished) and self.paths == self.unfinished


NO_SCENE = Showing()
