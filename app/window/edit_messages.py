"""What the editing half asks of the worker, and what it hears back."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from app.window.editing import Offer, Reading, Region
from app.window.poses import Pose
from langflash_core.scene.edits import Combine, History, Marks, Mask

if TYPE_CHECKING:
    from langflash_core.types import Scene


@dataclass(frozen=True)
class EditErrand:
    """A scene as its marks show it; the answer carries the same serial."""

    serial: int
    scene: "Scene" = field(repr=False)
    marks: Marks = field(repr=False)


@dataclass(frozen=True)
class FindInRegion(EditErrand):
    """Gaussians that a region shows. size: of the picture's place, pixels."""

    region: Region
    pose: Pose
    size: tuple[int, int]
    through: bool
    combine: Combine


@dataclass(frozen=True)
class FindByPhrase(EditErrand):
    """Gaussians that a phrase, or a language vector `like`, means from `threshold` on."""

    text: str
    like: bytes
    negatives: tuple[str, ...]
    threshold: float
    combine: Combine


@dataclass(frozen=True)
class FindAtom(EditErrand):
    """Gaussians that carry an atom more than any other."""

    atom: int
    combine: Combine


@dataclass(frozen=True)
class GrowSelection(EditErrand):
    """What lies within `reach` spacings of the selection; `within`: of what a phrase means."""

    reach: float
    within: FindByPhrase | None


@dataclass(frozen=True)
class ScoreFloaters(EditErrand):
    """How far every Gaussian stands out."""


@dataclass(frozen=True)
class Weigh(EditErrand):
    """The groups of a pixel whose weight maps are not drawn. size: of the picture's place."""

    reading: Reading
    pose: Pose
    size: tuple[int, int]


@dataclass(frozen=True)
class NamePlace(Weigh):
    """Words for a pixel with `weights` (K,), float32 bytes; none: not drawn, to be composed.

    extra: words beside the household's.
    """

    weights: bytes
    extra: tuple[str, ...]


@dataclass(frozen=True)
class NameAtoms(EditErrand):
    """Words for every atom."""


@dataclass(frozen=True)
class KeepEdits:
    """Write the edits where a crash cannot take them; `token` names the session."""

    serial: int
    scene: "Scene" = field(repr=False)
    history: History = field(repr=False)
    name: str
    path: Path | None
    token: str


@dataclass(frozen=True)
class ForgetEdits:
    """Remove what a session kept of a scene."""

    scene: "Scene" = field(repr=False)
    token: str


@dataclass(frozen=True)
class ForgetFile:
    """Remove a file of kept edits."""

    edits: Path


@dataclass(frozen=True)
class LookForEdits:
    """Edits that an earlier session kept: of a scene, or the newest of all."""

    serial: int
    scene: "Scene | None" = field(default=None, repr=False)
    path: Path | None = None


Request = (
    FindInRegion
    | FindByPhrase
    | FindAtom
    | GrowSelection
    | ScoreFloaters
    | Weigh
    | NamePlace
    | NameAtoms
    | KeepEdits
    | ForgetEdits
    | ForgetFile
    | LookForEdits
)


@dataclass(frozen=True)
class SelectionFound:
    """Rows that were looked for; `what` says how."""

    serial: int
    mask: Mask
    combine: Combine
    what: str


@dataclass(frozen=True)
class FloatersScored:
    """Scores (N,), float32 bytes."""

    serial: int
    scores: bytes


@dataclass(frozen=True)
class Weighed:
    """A reading with its groups."""

    serial: int
    reading: Reading


@dataclass(frozen=True)
class PlaceNamed:
    """(word, cosine), best first, and the place's language vector, float32 bytes.

    asked: the reading that was asked about; reading: the same with its groups.
    """

    serial: int
    asked: Reading
    reading: Reading
    words: tuple[tuple[str, float], ...]
    vector: bytes


@dataclass(frozen=True)
class AtomWords:
    """The nearest words of each atom, best first."""

    serial: int
    names: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class EditsFound:
    """Edits of an earlier session were found."""

    serial: int
    offer: Offer


@dataclass(frozen=True)
class EditsKept:
    """The edits lie in a file."""

    serial: int
    file: Path


Result = SelectionFound | FloatersScored | Weighed | PlaceNamed | AtomWords | EditsFound | EditsKept
