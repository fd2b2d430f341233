"""Preferences, and what of an earlier session is offered again."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

from langflash_core.base.pictures import NAMED

from ..asking.state import PALETTE, Prompt
from ..commands import Notify
from ..scene.commands import scene_photos
from ..scene.state import Photo
from ..state import State
from .preferences import PANEL_WIDTHS, SCALES, SPEEDS, Preferences
from .state import Kept, KeptPhoto, Offer

# Preferences


@dataclass(frozen=True)
class Prefer:
    """Other preferences; what is out of range is brought back into it."""

    preferences: Preferences

    def apply(self, state: State) -> State:
        wanted = self.preferences
        return replace(
            state,
            preferences=replace(
                wanted,
                scale=_within(wanted.scale, SCALES),
                speed=_within(wanted.speed, SPEEDS),
                panel_width=_within(wanted.panel_width, PANEL_WIDTHS),
            ),
        )


@dataclass(frozen=True)
class Opened:
    """A file was opened or saved: it is the newest of the recent ones."""

    path: Path

    def apply(self, state: State) -> State:
        return replace(state, preferences=state.preferences.opened(self.path))


@dataclass(frozen=True)
class ForgetRecent:
    """Empty the list of recent files, or take one out of it; what is remembered of them goes too."""

    path: str | None = None

    def apply(self, state: State) -> State:
        recent, projects = state.preferences.recent, state.recovery.projects
        left = () if self.path is None else tuple(each for each in recent if each != self.path)
        state = state.with_recovery(projects=tuple(each for each in projects if each.scene in left))
        return replace(state, preferences=replace(state.preferences, recent=left))


# Scenes that were open lately


@dataclass(frozen=True)
class ProjectsRead:
    """What is remembered of the recent scenes that are still there, the newest first."""

    projects: tuple[Kept, ...]

    def apply(self, state: State) -> State:
        recent = state.preferences.recent
        return state.with_recovery(projects=tuple(each for each in self.projects if each.scene in recent))


@dataclass(frozen=True)
class PictureGone:
    """The file of a scene has become another, and no small picture is of that (effects drop the old one)."""

    path: str

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class OpenProject:
    """Open a recent scene as it was left."""

    path: str

    def apply(self, state: State) -> State:
        return replace(state, dialog=None)


@dataclass(frozen=True)
class GoOnWith:
    """Read the scene of a project, now that nothing is in its way."""

    kept: Kept

    def apply(self, state: State) -> State:
        return state


@dataclass(frozen=True)
class StandAsLeft:
    """The scene of a project is there: its photos, its phrases, where one stood. Phrases of another scene go
    where it has its own."""

    kept: Kept

    def apply(self, state: State) -> State:
        if state.scene.info is None:
            return state
        kept = self.kept
        state = restored_phrases(restored_tray(state, kept.tray, kept.missing), kept)
        return StandAgain(kept).apply(state)


# A session that ended badly


@dataclass(frozen=True)
class CopyAt:
    """Where the scene on show is kept until somebody saves it."""

    path: Path

    def apply(self, state: State) -> State:
        return state.with_recovery(copy=self.path)


@dataclass(frozen=True)
class OfferSession:
    """It can be had back."""

    kept: Kept

    def apply(self, state: State) -> State:
        return state.with_recovery(session=self.kept)


@dataclass(frozen=True)
class EndSessionOffer:
    """Take the offer, or turn it down for good."""

    restore: bool

    def apply(self, state: State) -> State:
        kept = state.recovery.session
        state = state.with_recovery(session=None)
        if kept is None or not self.restore:
            return state
        return restored_phrases(restored_tray(state, kept.tray, kept.missing), kept)


def restored_tray(state: State, photos: Iterable[KeptPhoto], missing: Sequence[str]) -> State:
    """The tray with the photos of an earlier session, and a sentence on those that have gone."""
    state = state.with_scene(photos=tuple(Photo(Path(path), fov=fov) for path, fov in photos))
    if not missing:
        return state
    others = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
    text = f"{missing[0]}{others} can no longer be found; drop the photos again to use them."
    return Notify(text, "info").apply(state)


def kept_photos(photos: Iterable[Photo]) -> tuple[KeptPhoto, ...]:
    """As they are kept."""
    return tuple((str(photo.path), photo.fov) for photo in photos)


def kept_session(state: State, scene: Path | None) -> Kept:
    """What is kept of the tray, the phrases and the view. scene: where the scene on show lies, if it does."""
    info, prompts = state.scene.info, [prompt for prompt in state.asking.prompts if prompt.text.strip()]
    kept = Kept(
        scene="" if scene is None else str(scene),
        edits="" if state.recovery.kept is None else str(state.recovery.kept),
        saved=info is None or info.path is not None,
        name="" if info is None else info.name,
        phrases=tuple(prompt.text for prompt in prompts),
        likes=tuple(prompt.like.hex() for prompt in prompts),
        thresholds=tuple(prompt.threshold for prompt in prompts),
        colours=tuple(prompt.colour for prompt in prompts),
        visible=tuple(prompt.visible for prompt in prompts),
        mode=state.scene.mode.name,
        pose=None if info is None else state.scene.pose,
        aside=None if state.scene.aside is None else kept_photos(state.scene.aside),
        views=0 if info is None else len(info.views),
    )
    return kept.with_photos(kept_photos(state.scene.photos))


def restored_phrases(state: State, kept: Kept) -> State:
    """The phrases of a kept session in rows of their own, those that ask for a place among them."""
    rows = []
    told = (kept.phrases, kept.likes, kept.thresholds, kept.colours, kept.visible)
    for text, like, threshold, colour, visible in zip_longest(*told):
        shade = colour or PALETTE[len(rows) % len(PALETTE)]
        vector, shown = bytes.fromhex(like or ""), visible is not False
        row = Prompt(state.next_key + len(rows), text, shade, threshold, visible=shown, like=vector)
        rows.append(row)
    if not rows:
        return state
    return replace(
        state.with_asking(prompts=tuple(rows), active=rows[0].key), next_key=state.next_key + len(rows)
    )


@dataclass(frozen=True)
class StandAgain:
    """The camera and the mode of a kept session, once its scene is there; a scene that nobody saved is called
    what it was called."""

    kept: Kept

    def apply(self, state: State) -> State:
        info, kept = state.scene.info, self.kept
        if info is None:
            return state
        info = info if kept.saved else replace(info, name=kept.name, path=None)
        mode = NAMED.get(kept.mode.lower(), state.scene.mode)  # earlier versions wrote capitals
        pose = kept.pose or state.scene.pose
        view = state.scene.view if pose == state.scene.pose else None
        return state.with_scene(info=info, mode=mode, pose=pose, view=view)


@dataclass(frozen=True)
class CopyKept:
    """A copy of the scene on show is complete at `path`."""

    path: Path

    def apply(self, state: State) -> State:
        return state


# Edits of an earlier session


@dataclass(frozen=True)
class EditsKept:
    """Where the edits lie until they are saved; None: nowhere."""

    file: Path | None

    def apply(self, state: State) -> State:
        return state.with_recovery(kept=self.file)


@dataclass(frozen=True)
class OfferEdits:
    """Edits were found that nobody saved."""

    offer: Offer

    def apply(self, state: State) -> State:
        return state.with_recovery(edits=self.offer)


@dataclass(frozen=True)
class EndOffer:
    """Restore the edits with the photos of their scene, or `forget` them for good; otherwise they are
    offered again next time."""

    restore: bool = False
    forget: bool = False

    def apply(self, state: State) -> State:
        offer = state.recovery.edits
        state = state.with_recovery(edits=None)
        if offer is None or not self.restore or not (offer.photos or offer.missing):
            return state
        before = scene_photos(state) if state.scene.info is not None else None
        return restored_tray(state.with_scene(aside=before), offer.photos, offer.missing)


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
