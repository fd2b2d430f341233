"""What can happen, one frozen dataclass each; `apply(state, command)` is the next state, purely.

A command that also needs the outside world (the worker, a file, a clock) is seen once more by
the session after its pure change. Times come from `state.now`.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from app.window import poses
from app.window.asking import PROMPT_DIALOGS, PROMPTS_SUFFIX
from app.window.drops import MAX_PHOTOS, SCENE_SUFFIX
from app.window.edit_commands import fresh
from app.window.poses import Pose
from app.window.state import (
    FLIGHT_SECONDS,
    PALETTE,
    TOAST_SECONDS,
    Flight,
    Job,
    Mode,
    Photo,
    Prompt,
    SceneInfo,
    State,
    Stats,
    Toast,
)
from langflash_core.scene.edits import Marks

_NOTHING_TO_SAVE = "There is no scene to save; drop photos on the window first."


class Command(Protocol):
    """Anything with a pure change of state."""

    def apply(self, state: State) -> State: ...


def apply(state: State, command: Command) -> State:
    """The state after `command`."""
    return command.apply(state)


@dataclass(frozen=True)
class Tick:
    """Time passes: flights advance, old toasts go."""

    now: float

    def apply(self, state: State) -> State:
        toasts = tuple(t for t in state.toasts if t.until > self.now)
        pose, flight = state.pose, state.flight
        if flight is not None:
            fraction = (self.now - flight.began) / FLIGHT_SECONDS
            pose = poses.blend(flight.start, flight.end, fraction)
            flight = flight if fraction < 1.0 else None
        return replace(state, now=self.now, toasts=toasts, pose=pose, flight=flight)


@dataclass(frozen=True)
class Notify:
    """Show a message; the same text is shown once."""

    text: str
    kind: str = "error"

    def apply(self, state: State) -> State:
        others = tuple(t for t in state.toasts if t.text != self.text)
        toast = Toast(state.next_key, self.text, self.kind, state.now + TOAST_SECONDS[self.kind])
        return replace(state, toasts=(*others, toast)[-4:], next_key=state.next_key + 1)


@dataclass(frozen=True)
class DismissToast:
    """Take a message away."""

    key: int

    def apply(self, state: State) -> State:
        return replace(state, toasts=tuple(t for t in state.toasts if t.key != self.key))


@dataclass(frozen=True)
class CopyText:
    """Put text on the clipboard (the session does)."""

    text: str

    def apply(self, state: State) -> State:
        return state


# Photos and scenes


@dataclass(frozen=True)
class AddPhotos:
    """Append photos to the tray, each once, up to what the network takes."""

    paths: tuple[Path, ...]

    def apply(self, state: State) -> State:
        known = {p.path for p in state.photos}
        fresh = tuple(Photo(p) for p in dict.fromkeys(self.paths) if p not in known)
        photos = (*state.photos, *fresh)
        after = replace(state, photos=photos[:MAX_PHOTOS])
        if len(photos) > MAX_PHOTOS:
            left = len(photos) - MAX_PHOTOS
            text = f"{left} photos were left out: at most {MAX_PHOTOS} make one scene; clear the tray first."
            after = Notify(text).apply(after)
        return after


@dataclass(frozen=True)
class RemovePhoto:
    """Take a photo out of the tray."""

    index: int

    def apply(self, state: State) -> State:
        return replace(state, photos=state.photos[: self.index] + state.photos[self.index + 1 :])


@dataclass(frozen=True)
class ClearPhotos:
    """Empty the tray; the scene stays."""

    def apply(self, state: State) -> State:
        return replace(state, photos=())


@dataclass(frozen=True)
class PhotoFailed:
    """A photo could not be read for its thumbnail."""

    path: Path
    problem: str

    def apply(self, state: State) -> State:
        photos = (replace(p, problem=self.problem) if p.path == self.path else p for p in state.photos)
        return replace(state, photos=tuple(photos))


@dataclass(frozen=True)
class Reconstruct:
    """Make a scene of the photos in the tray; replaces a job under way."""

    def apply(self, state: State) -> State:
        if not state.photos:
            return Notify("There is no photo to reconstruct; drop two photos on the window.").apply(state)
        return replace(state, job=Job("Reconstructing", "starting", started=state.now))


@dataclass(frozen=True)
class OpenScene:
    """Read a scene file; replaces a job under way. edits: kept by an earlier session."""

    path: Path
    edits: Path | None = None

    def apply(self, state: State) -> State:
        title = "Restoring" if self.edits else f"Opening {self.path.name}"
        return replace(state, job=Job(title, "reading", started=state.now))


@dataclass(frozen=True)
class SaveScene:
    """Write the scene on show to `path`."""

    path: Path

    def apply(self, state: State) -> State:
        if state.info is None:
            return Notify(_NOTHING_TO_SAVE).apply(state)
        return replace(state, dialog=None)


@dataclass(frozen=True)
class OpenPaths:
    """Paths that behave like a drop (the open dialog, the command line)."""

    paths: tuple[str, ...]

    def apply(self, state: State) -> State:
        return replace(state, dialog=None)


@dataclass(frozen=True)
class ShowDialog:
    """`which` is a key of `panels.overlays.TITLES`; None closes."""

    which: str | None

    def apply(self, state: State) -> State:
        if self.which == "save" and state.info is None:
            return Notify(_NOTHING_TO_SAVE).apply(state)
        path = str(_place_to_save(state)) if self.which == "save" else ""
        if self.which in PROMPT_DIALOGS:
            path = str(state.asking.prompts_path or Path.home() / f"my{PROMPTS_SUFFIX}")
        return replace(state, dialog=self.which, dialog_path=path)


@dataclass(frozen=True)
class EditDialogPath:
    """New text in the dialog's path field."""

    path: str

    def apply(self, state: State) -> State:
        return replace(state, dialog_path=self.path)


@dataclass(frozen=True)
class CancelJob:
    """Ask the job to stop; it ends after its present stage."""

    def apply(self, state: State) -> State:
        return state if state.job is None else replace(state, job=replace(state.job, cancelling=True))


@dataclass(frozen=True)
class Leave:
    """Close the window; asks first when a scene would be lost, unless `sure`."""

    sure: bool = False

    def apply(self, state: State) -> State:
        unsaved = state.info is not None and state.info.path is None
        if unsaved and not self.sure:
            return replace(state, dialog="leave")
        return replace(state, leaving=True, dialog=None)


# Prompts


@dataclass(frozen=True)
class AddPrompt:
    """A new, empty row in a colour of its own."""

    def apply(self, state: State) -> State:
        used = {p.colour for p in state.prompts}
        free = [c for c in PALETTE if c not in used] or [PALETTE[len(state.prompts) % len(PALETTE)]]
        prompt = Prompt(state.next_key, colour=free[0])
        prompts = (*state.prompts, prompt)
        return replace(state, prompts=prompts, active=prompt.key, next_key=state.next_key + 1)


@dataclass(frozen=True)
class RemovePrompt:
    """The last row is emptied, never removed."""

    key: int

    def apply(self, state: State) -> State:
        prompts = tuple(p for p in state.prompts if p.key != self.key)
        if not prompts:
            prompts = (Prompt(state.next_key),)
            state = replace(state, next_key=state.next_key + 1)
        active = state.active if any(p.key == state.active for p in prompts) else prompts[0].key
        return _with_prompts(replace(state, active=active), prompts)


@dataclass(frozen=True)
class EditPrompt:
    """New text; the old answer no longer holds. The first phrase turns the heat-map on."""

    key: int
    text: str

    def apply(self, state: State) -> State:
        after = _change_prompt(state, self.key, text=self.text, score=None, like=b"")
        first = not state.asked and bool(after.asked)
        mode = Mode.HEAT if first and state.mode is Mode.RGB else after.mode
        return replace(after, mode=mode, active=self.key)


@dataclass(frozen=True)
class ColourPrompt:
    """Another colour, sRGB in [0, 1]."""

    key: int
    colour: tuple[float, float, float]

    def apply(self, state: State) -> State:
        return _change_prompt(state, self.key, colour=self.colour)


@dataclass(frozen=True)
class SetThreshold:
    """None goes back to the calibrated threshold."""

    key: int
    threshold: float | None

    def apply(self, state: State) -> State:
        return _change_prompt(state, self.key, threshold=self.threshold)


@dataclass(frozen=True)
class ShowPrompt:
    """Ask a phrase, or leave it out."""

    key: int
    visible: bool

    def apply(self, state: State) -> State:
        return _change_prompt(state, self.key, visible=self.visible)


@dataclass(frozen=True)
class SelectPrompt:
    """The prompt whose heat-map is on show."""

    key: int

    def apply(self, state: State) -> State:
        return replace(state, active=self.key)


@dataclass(frozen=True)
class SetNegatives:
    """What relevancy is measured against."""

    negatives: tuple[str, ...]

    def apply(self, state: State) -> State:
        return replace(state, negatives=self.negatives)


@dataclass(frozen=True)
class Answered:
    """Scores in the view on show: (key, text, score); a prompt edited meanwhile keeps none."""

    scores: tuple[tuple[int, str, float], ...]

    def apply(self, state: State) -> State:
        current = {p.key: p.text.strip() for p in state.prompts}
        for key, text, score in self.scores:
            if current.get(key) == text:
                state = _change_prompt(state, key, score=score)
        return state


@dataclass(frozen=True)
class Calibrated:
    """The threshold that the scene and its language space were calibrated to."""

    threshold: float

    def apply(self, state: State) -> State:
        return _with_prompts(state, tuple(replace(p, calibrated=self.threshold) for p in state.prompts))


# The picture and the camera


@dataclass(frozen=True)
class SetMode:
    """What the picture shows."""

    mode: Mode

    def apply(self, state: State) -> State:
        return replace(state, mode=self.mode)


@dataclass(frozen=True)
class JumpTo:
    """Fly to input view `view`; `Home` is view 0."""

    view: int

    def apply(self, state: State) -> State:
        if state.info is None or not 0 <= self.view < len(state.info.views):
            return state
        flight = Flight(state.pose, state.info.views[self.view], state.now)
        return replace(state, flight=flight, view=self.view)


@dataclass(frozen=True)
class FlyTo:
    """Fly to a pose that is no photo's."""

    pose: Pose

    def apply(self, state: State) -> State:
        return replace(state, flight=Flight(state.pose, self.pose, state.now), view=None)


@dataclass(frozen=True)
class Home:
    """Fly back to the first photo's view."""

    def apply(self, state: State) -> State:
        return JumpTo(0).apply(state)


@dataclass(frozen=True)
class MoveTo:
    """Stand at `pose`: a step of an orbit, pan, zoom or fly. Ends a flight."""

    pose: Pose

    def apply(self, state: State) -> State:
        return replace(state, pose=self.pose, flight=None, view=None)


@dataclass(frozen=True)
class SetFov:
    """Another field of view, degrees."""

    degrees: float

    def apply(self, state: State) -> State:
        return MoveTo(poses.with_fov(state.pose, self.degrees)).apply(state)


# What the worker reports


@dataclass(frozen=True)
class Progressed:
    """A stage of the job, 0 to 1; a new stage files the last one with its seconds."""

    stage: str
    fraction: float

    def apply(self, state: State) -> State:
        job = state.job
        if job is None:
            return state
        fraction = min(max(self.fraction, 0.0), 1.0)
        if self.stage == job.stage:
            return replace(state, job=replace(job, fraction=fraction))
        done = (*job.done, (job.stage, state.now - job.started))
        return replace(
            state, job=replace(job, stage=self.stage, fraction=fraction, started=state.now, done=done)
        )


@dataclass(frozen=True)
class SceneArrived:
    """A scene is ready: show it from its first view, ask every prompt again."""

    info: SceneInfo

    def apply(self, state: State) -> State:
        prompts = tuple(replace(p, score=None) for p in state.prompts)
        history = self.info.history
        saved = None if history is None else history.moved_to(0).marks
        return replace(
            state,
            editing=fresh(state.editing, history, saved),
            asking=state.asking.without_scene(),
            info=self.info,
            prompts=prompts,
            job=None,
            flight=None,
            pose=self.info.views[0] if self.info.views else poses.START,
            view=0 if self.info.views else None,
        )


@dataclass(frozen=True)
class SceneSaved:
    """The scene on show, edited up to `marks`, now lives at `path`."""

    path: Path
    marks: Marks | None = None

    def apply(self, state: State) -> State:
        info = None if state.info is None else replace(state.info, path=self.path, name=self.path.name)
        saved = self.marks or state.editing.saved
        state = replace(state, info=info, editing=replace(state.editing, saved=saved))
        return Notify(f"Saved {self.path}", "info").apply(state)


@dataclass(frozen=True)
class JobFailed:
    """The job ended without a scene; a sentence with a remedy."""

    sentence: str

    def apply(self, state: State) -> State:
        return Notify(self.sentence).apply(replace(state, job=None))


@dataclass(frozen=True)
class JobCancelled:
    """The job ended because the person stopped it."""

    def apply(self, state: State) -> State:
        return Notify("Stopped.", "info").apply(replace(state, job=None))


@dataclass(frozen=True)
class Measured:
    """Figures for the status bar."""

    stats: Stats

    def apply(self, state: State) -> State:
        return replace(state, stats=self.stats)


def _place_to_save(state: State) -> Path:
    """The scene's own file, or one beside its first photo."""
    if state.info is not None and state.info.path is not None:
        return state.info.path
    if state.photos:
        return state.photos[0].path.with_suffix(SCENE_SUFFIX)
    return Path.home() / f"scene{SCENE_SUFFIX}"


def _with_prompts(state: State, prompts: tuple[Prompt, ...]) -> State:
    return replace(state, prompts=prompts)


def _change_prompt(state: State, key: int, **changes) -> State:
    return _with_prompts(state, tuple(replace(p, **changes) if p.key == key else p for p in state.prompts))
