"""What the window asks of the worker and what it hears back: frozen snapshots, nothing shared.

Imports nothing heavy: the window builds these before torch is loaded.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from app.window import ask_messages, edit_messages
from app.window.state import SceneInfo
from langflash_core.scene.edits import Marks

if TYPE_CHECKING:
    from torch import Tensor

    from langflash_core.language.relevance import CompiledQuery
    from langflash_core.types import Camera, Frame, Scene


# Requests: jobs, of which the latest wins and cancels the one under way


@dataclass(frozen=True)
class ReconstructPhotos:
    """Make a scene of photos. fovs: degrees of the longer side, one per photo; None: its record."""

    paths: tuple[Path, ...]
    fovs: tuple[float | None, ...] = ()


@dataclass(frozen=True)
class LoadScene:
    """Read a scene file; or, with `edits`, the scene and the history that an earlier session kept."""

    path: Path
    edits: Path | None = None


# Requests: small ones, answered between the stages of a job


@dataclass(frozen=True)
class WriteScene:
    """Write a scene file of the scene as edited."""

    scene: "Scene"
    path: Path
    marks: Marks | None = None


@dataclass(frozen=True)
class Encode:
    """Compile prompts against a scene; only the newest one counts.

    likes: per prompt a language vector as float32 bytes, asked instead of the text, or none.
    """

    serial: int
    scene: "Scene"
    keys: tuple[int, ...]
    texts: tuple[str, ...]
    negatives: tuple[str, ...]
    likes: tuple[bytes, ...] = ()
    marks: Marks | None = None


@dataclass(frozen=True)
class Answer:
    """Score prompts in one view; only the newest one counts."""

    serial: int
    keys: tuple[int, ...]
    relevance: "Tensor"
    frame: "Frame"
    camera: "Camera"
    query: "CompiledQuery"


@dataclass(frozen=True)
class MakeThumbnails:
    """Decode photos small."""

    paths: tuple[Path, ...]


@dataclass(frozen=True)
class KeepCopy:
    """Write a scene that nobody saved where a crash cannot take it; with `marks` as they edit it."""

    serial: int
    scene: "Scene"
    path: Path
    marks: Marks | None = None


@dataclass(frozen=True)
class FindPair:
    """The two photos that make the best scene."""

    paths: tuple[Path, ...]


Job = ReconstructPhotos | LoadScene
Errand = (
    WriteScene
    | Encode
    | Answer
    | MakeThumbnails
    | KeepCopy
    | FindPair
    | ask_messages.Request
    | edit_messages.Request
)


# Results


@dataclass(frozen=True)
class Progress:
    """A stage of the job and how far it is, 0 to 1."""

    stage: str
    fraction: float


@dataclass(frozen=True)
class SceneReady:
    """The job's scene."""

    info: SceneInfo


@dataclass(frozen=True)
class SceneWritten:
    """A scene file is complete; it holds the edits up to `marks`."""

    path: Path
    marks: Marks | None = None


@dataclass(frozen=True)
class Failed:
    """`job` tells whether the job under way is over; otherwise an errand failed."""

    sentence: str
    job: bool


@dataclass(frozen=True)
class Stopped:
    """The job was cancelled by the person."""


@dataclass(frozen=True)
class Compiled:
    """Prompts ready to be asked; `keys` in the order of `query`."""

    serial: int
    keys: tuple[int, ...]
    query: "CompiledQuery"


@dataclass(frozen=True)
class Scored:
    """(key, text, score) per prompt."""

    serial: int
    scores: tuple[tuple[int, str, float], ...]


@dataclass(frozen=True)
class Thumbnail:
    """rgb (h, w, 3) uint8, or None with the reason; `key` names the texture.

    fov: recorded in the file, degrees of the longer side. notes: triage.
    """

    key: str
    rgb: np.ndarray | None
    problem: str = ""
    fov: float | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class CopyKept:
    """The copy is there."""

    serial: int
    path: Path


@dataclass(frozen=True)
class PairFound:
    """`pair`: places in `paths`; None where no two match, with a problem where it could not be told."""

    paths: tuple[Path, ...]
    pair: tuple[int, int] | None
    problem: str = ""


Result = (
    Progress
    | SceneReady
    | SceneWritten
    | Failed
    | Stopped
    | Compiled
    | Scored
    | Thumbnail
    | edit_messages.Result
    | ask_messages.Result
    | CopyKept
    | PairFound
)
