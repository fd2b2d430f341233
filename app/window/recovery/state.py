"""What is kept for the next time: a window's record, edits that nobody saved."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

from langflash_core.geometry.poses import Pose

from ..scene.drops import SCENE_SUFFIX

KeptPhoto = tuple[str, float | None]
"""A photo of the tray: its path, and the person's own field of view in degrees."""


@dataclass(frozen=True)
class Kept:
    """What a window holds, and how its scene was left. scene: its file, or the copy kept of one that was
    never saved, then `saved` is false. edits: the file of those that nobody saved. phrases: texts. likes: of
    each phrase the language vector that it asks instead, float32 bytes in hexadecimal digits, or none.
    thresholds: of each phrase the person's own. colours, visible: of each phrase. aside: photos of the scene,
    where those in the tray are a new room's. views: photos that it is made of, 0 where nobody knows. file:
    where this was read from. when: it was written. missing: names of photos that were in the tray and are
    not on the disk any more."""

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
    aside: tuple[KeptPhoto, ...] | None = None
    views: int = 0
    file: Path | None = None
    when: datetime | None = None
    missing: tuple[str, ...] = ()

    @property
    def empty(self) -> bool:
        """Whether nothing would be lost."""
        return not (self.photos or self.scene or any(self.phrases))

    @property
    def tray(self) -> tuple[KeptPhoto, ...]:
        """The photos with their fields of view."""
        return tuple(zip(self.photos, self.fovs, strict=True))

    @property
    def picture(self) -> str:
        """What the small picture of the scene is called."""
        return f"project {self.scene}"

    def with_photos(self, photos: Sequence[KeptPhoto], missing: tuple[str, ...] = ()) -> "Kept":
        """With others in the tray."""
        paths, fovs = tuple(path for path, _ in photos), tuple(fov for _, fov in photos)
        return replace(self, photos=paths, fovs=fovs, missing=missing)

    def closed(self) -> "Kept":
        """How the scene was left: with its own photos, and its edits are offered by themselves."""
        kept = replace(self, edits="", aside=None, file=None)
        return kept if self.aside is None else kept.with_photos(self.aside)

    def sentence(self) -> str:
        """What a session holds, for people."""
        named = self.name or Path(self.scene).name
        return ", ".join([named] * bool(self.scene) + self._counted(len(self.photos)))

    def project_sentence(self) -> str:
        """What a scene holds, for people; nothing where it is not known."""
        return ", ".join(self._counted(self.views))

    def _counted(self, photos: int) -> list[str]:
        phrases = sum(bool(phrase.strip()) for phrase in self.phrases)
        counted = ((photos, "photo"), (phrases, "phrase"))
        return [f"{count} {word}{'s' * (count > 1)}" for count, word in counted if count]


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
    projects: tuple[Kept, ...] = ()


NO_RECOVERY = Recovery()
