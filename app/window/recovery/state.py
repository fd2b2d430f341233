"""What is kept for the next time: a session that ended badly, edits that nobody saved."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from langflash_core.geometry.poses import Pose

from ..scene.drops import SCENE_SUFFIX

KeptPhoto = tuple[str, float | None]
"""A photo of the tray: its path, and the person's own field of view in degrees."""


@dataclass(frozen=True)
class Kept:
    """What a session holds. scene: its file, or the copy kept of one that was never saved, then
    `saved` is false. edits: the file of those that nobody saved. phrases: texts. likes: of each phrase
    the language vector that it asks instead, float32 bytes in hexadecimal digits, or none. thresholds: of
    each phrase the person's own. colours, visible: of each phrase. file: where this was read from.
    missing: names of photos that were in the tray and are not on the disk any more."""

    photos: tuple[str, ...] = ()
    fovs: tuple[float | None, ...] = ()
    scene: str = ""
    edits: str = ""
    saved: bool = True
    name: str = ""
    phrases: tuple[str, ...] = ()
    likes: tuple[str, ...] = ()
    thresholds: tuple[float | None, ...] = ()
    colours: tuple[tuple[float, float, float], ...] = ()
    visible: tuple[bool, ...] = ()
    mode: str = "rgb"
    pose: Pose | None = None
    file: Path | None = None
    missing: tuple[str, ...] = ()

    @property
    def empty(self) -> bool:
        """Whether nothing would be lost."""
        return not (self.photos or self.scene or any(self.phrases))

    def sentence(self) -> str:
        """What it holds, for people."""
        parts = [self.name or Path(self.scene).name] if self.scene else []
        if self.photos:
            parts.append(f"{len(self.photos)} photo{'s' * (len(self.photos) > 1)}")
        phrases = [phrase for phrase in self.phrases if phrase.strip()]
        if phrases:
            parts.append(f"{len(phrases)} phrase{'s' * (len(phrases) > 1)}")
        return ", ".join(parts)


@dataclass(frozen=True)
class Offer:
    """Edits of an earlier session that were not saved. edits: the file. when: written. photos: those that
    were in the tray, with their fields of view. missing: names of those not on the disk any more."""

    edits: Path
    name: str
    count: int
    when: datetime
    photos: tuple[KeptPhoto, ...] = ()
    missing: tuple[str, ...] = ()

    @property
    def scene(self) -> Path:
        """The scene as it was before them, kept beside them."""
        return self.edits.with_suffix(SCENE_SUFFIX)


@dataclass(frozen=True)
class Project:
    """A scene that was open lately, as it was left. path: of its file. views: photos that it is made of, 0
    where nobody knows. when: it was open last; None where that is not known."""

    path: str
    kept: Kept = Kept()
    views: int = 0
    when: datetime | None = None

    @property
    def picture(self) -> str:
        """What its small picture is called."""
        return f"project {self.path}"

    def sentence(self) -> str:
        """What it holds, for people; nothing where it is not known."""
        phrases = sum(bool(phrase.strip()) for phrase in self.kept.phrases)
        counted = ((self.views, "photo"), (phrases, "phrase"))
        return ", ".join(f"{count} {word}{'s' * (count > 1)}" for count, word in counted if count)


@dataclass(frozen=True)
class Recovery:
    """The recovery half of the state.

    session: one that ended badly, offered again. edits: those of an earlier session that nobody
    saved. copy: where a scene that nobody saved is kept. kept: the file that holds unsaved edits.
    projects: scenes that were open before this window, the last one first.
    """

    session: Kept | None = None
    edits: Offer | None = None
    copy: Path | None = None
    kept: Path | None = None
    projects: tuple[Project, ...] = ()


NO_RECOVERY = Recovery()
