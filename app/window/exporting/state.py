"""What to write, as the export dialog has it, and the export under way."""

from dataclasses import dataclass
from pathlib import Path

from langflash_core.base.outputs import RGB, Output
from langflash_core.base.running import time_left

SECONDS = (1.0, 60.0)


@dataclass(frozen=True)
class ExportForm:
    """all_views: from every photo instead of the view on show. only_found: just what answers the
    phrases. only_selected: just the selection, where Gaussians are written. side: the longer one in
    pixels. fade: leave out what no photo looked at; None: as the window does. way: of a film, of
    `filming.state.WAYS`; empty: `order.way`. path: as typed; an ending is added. proposed: the path that
    nobody has typed. serial: of the scene that `path` is for."""

    what: Output = RGB
    all_views: bool = False
    only_found: bool = False
    only_selected: bool = False
    side: int = 1024
    seconds: float = 6.0
    fade: bool | None = None
    way: str = ""
    path: str = ""
    proposed: str = ""
    serial: int = 0


@dataclass(frozen=True)
class Running:
    """An export under way. fraction: 0 to 1, below 0 while nothing is known. started: by `State.now`."""

    target: Path
    stage: str = "starting"
    fraction: float = -1.0
    cancelling: bool = False
    started: float = 0.0

    def told(self, now: float) -> str:
        """What is being done, or how long it still takes once that is known."""
        return "stopping" if self.cancelling else time_left(now - self.started, self.fraction) or self.stage


NO_FORM = ExportForm()


@dataclass(frozen=True)
class Target:
    """What the disk says of the path in the form. folder: it is one. scene, photo: what is written there
    would replace the scene that is read, a photo of the tray."""

    folder: bool = False
    scene: bool = False
    photo: bool = False


NO_TARGET = Target()


@dataclass(frozen=True)
class Exporting:
    """The exporting half of the state. edited, selection: copies that an export reads, of the scene
    with unsaved edits and of what is selected. there: files that it would replace, while it is asked.
    target: what the disk said of the path in the form."""

    form: ExportForm = NO_FORM
    running: Running | None = None
    edited: Path | None = None
    selection: Path | None = None
    there: tuple[Path, ...] = ()
    target: Target = NO_TARGET


NO_EXPORTING = Exporting()
