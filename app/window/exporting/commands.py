"""What can happen to an export: the dialog, and the process that writes."""

from dataclasses import dataclass, replace
from pathlib import Path

from langflash_core.base.outputs import RGB, ROOM, Output

from ..commands import Notify
from ..dialogs import Dialog
from ..protocol import Outward
from ..scene import samples
from ..state import State
from .state import ExportForm, Running, Target

_SAID_HERE = {
    "lower --threshold": "lower its threshold",
    "choose another --view": "look from where it is seen",
}
"""Of the command's words, the window's."""


@dataclass(frozen=True)
class EditForm:
    """The export dialog as the person left it; a new kind takes a name and an ending of its own."""

    form: ExportForm

    def apply(self, state: State) -> State:
        old, form = state.exporting.form, self.form
        if form.what is not old.what:
            path = _renamed(form.path, old.what, form.what) if form.path == old.path else form.path
            form = replace(form, path=path, proposed=_renamed(form.proposed, old.what, form.what))
        return state.with_exporting(form=form)


@dataclass(frozen=True)
class ShowExport:
    """Open the export dialog, with a place to write to: what the person typed for this scene, or else one
    that is named after it. what: the kind that is wanted; None: as it was left, of those of the dialog."""

    what: Output | None = None

    def apply(self, state: State) -> State:
        info = state.scene.info
        if info is None:
            text = "There is no scene to export; drop photos on the window first."
            return Notify(text).apply(state)
        wanted = self.what or (RGB if state.exporting.form.what in ROOM else state.exporting.form.what)
        state = EditForm(replace(state.exporting.form, what=wanted)).apply(state)
        form = state.exporting.form
        proposed = str(_place(state, form.what))
        own = form.path not in ("", form.proposed) and form.serial == info.serial
        selected = form.only_selected and state.editing.num_selected > 0
        form = replace(
            form,
            path=form.path if own else proposed,
            proposed=proposed,
            serial=info.serial,
            only_selected=selected,
        )
        return replace(state.with_exporting(form=form), dialog=Dialog.EXPORT)


@dataclass(frozen=True)
class Export(Outward):
    """Do what the form says; asks first where a file would be replaced, unless `sure`."""

    sure: bool = False


@dataclass(frozen=True)
class AskToReplace:
    """The export would write over these files."""

    there: tuple[Path, ...]

    def apply(self, state: State) -> State:
        return replace(state.with_exporting(there=self.there), dialog=Dialog.REPLACE)


@dataclass(frozen=True)
class TargetLookedUp:
    """What the disk says of the path in the form."""

    target: Target

    def apply(self, state: State) -> State:
        return state.with_exporting(target=self.target)


@dataclass(frozen=True)
class ExportBegan:
    """The command runs."""

    target: Path

    def apply(self, state: State) -> State:
        return replace(state, dialog=None).with_exporting(running=Running(self.target, started=state.now))


@dataclass(frozen=True)
class ExportProgressed:
    """A stage and the fraction of the whole."""

    stage: str
    fraction: float

    def apply(self, state: State) -> State:
        now = state.exporting.running
        if now is None:
            return state
        fraction = min(max(self.fraction, 0.0), 1.0)
        return state.with_exporting(running=replace(now, stage=self.stage, fraction=fraction))


@dataclass(frozen=True)
class CancelExport:
    """Stop it; nothing is written."""

    def apply(self, state: State) -> State:
        now = state.exporting.running
        return state if now is None else state.with_exporting(running=replace(now, cancelling=True))


@dataclass(frozen=True)
class ExportEnded:
    """code: 0 done. said: the command's own words. error: its sentence."""

    code: int
    said: str
    error: str

    def apply(self, state: State) -> State:
        was = state.exporting.running
        state = state.with_exporting(running=None)
        if was is not None and was.cancelling and self.code != 0:
            return Notify("The export was stopped; nothing was written.", "info").apply(state)
        if self.code == 0:
            return Notify(f"Exported {self.said}", "info").apply(state)
        said = self.error or f"The export failed (code {self.code})."
        for there, here in _SAID_HERE.items():
            said = said.replace(there, here)
        return Notify(said).apply(state)


@dataclass(frozen=True)
class CopiesAt:
    """Where the export reads a scene with unsaved edits, and its selection; None: there are none."""

    edited: Path | None
    selection: Path | None

    def apply(self, state: State) -> State:
        return state.with_exporting(edited=self.edited, selection=self.selection)


def _place(state: State, what: Output) -> Path:
    """Beside the scene, or beside its photos, by a name of its own for each kind."""
    assert state.scene.info is not None
    beside = state.scene.info.path or samples.beside(state.scene.photos)
    return beside.with_name(f"{beside.stem}{what.ends}{what.suffix}")


def _renamed(path: str, old: Output, new: Output) -> str:
    """The path of one kind as that of another; one that does not end as its kind stays as it is."""
    if not path.lower().endswith(old.suffix):
        return path
    return path[: len(path) - len(old.suffix)].removesuffix(old.ends) + new.ends + new.suffix
