"""The request that does what the export dialog says.

The window runs the command that says the same in a process of its own, so what is shown is what is done.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from langflash_core.base.outputs import PAGE, SEGMENTED
from langflash_core.base.request import ExportRequest

from ..scene.drops import typed_path
from ..scene.near import fills_gaps, keeps_near, photos_known
from ..state import State
from .state import ExportForm, Target


@dataclass(frozen=True)
class Order:
    """What the dialog comes to: what to write, a camera file to write first, and all files that will be
    written."""

    request: ExportRequest
    camera_file: Path | None = None
    files: tuple[Path, ...] = ()


def order(state: State) -> Order | str:
    """What the form says as it stands, or a sentence that says what is missing."""
    target = _target(state)
    if isinstance(target, str):
        return target
    phrases, problem = _phrases(state)
    if problem:
        return problem
    form = state.exporting.form
    what, goes = form.what, way(state) if form.what.moves else ""
    if goes == "keys" and len(state.keys) < 2:
        return "A film along key frames needs two of them; fly somewhere and add one (M)."
    if goes == "tour" and not state.tour.stops:
        return "A film along the tour needs a stop; fly somewhere and add one in the tour's panel."
    camera_file = _camera_file(state, target)
    request = ExportRequest(
        target,
        source(state),
        what=what.word or None,
        segmented=what is SEGMENTED,
        prompts=phrases,
        threshold=_threshold(state) if phrases else None,
        fade=fades(state),
        fill=what.fills and fills_gaps(state) and (what.phrases == "one" or not phrases),
        size=pixels(form.side, shape(state)) if what.sized else None,
        **_seen_from(state, camera_file),
        **(_colours(state) if what.colours else {}),
    )
    return Order(request, camera_file, (*_written(state, target), *((camera_file,) if camera_file else ())))


def _target(state: State) -> Path | str:
    """The file, or what is wrong with its name."""
    form, info = state.exporting.form, state.scene.info
    if info is None:
        return "There is no scene to export; drop photos on the window first."
    scene_file = source(state)
    if scene_file is None:
        return "The scene has no file yet; save it first."
    target, there = typed_target(form), state.exporting.target
    if target is None or (there.folder and form.what.suffix):
        return "Type a file name."
    if there.scene:
        return "This file is the scene itself; choose another name."
    if there.photo:
        return "This would replace one of your photos; choose another name."
    return target


def look_up(state: State) -> Target:
    """Ask the disk about the path in the form; effects do, and what they learn is for `order`."""
    form, info = state.exporting.form, state.scene.info
    target, folder = typed_target(form), os.path.isdir(typed_path(form.path))
    if target is None or info is None:
        return Target(folder)
    photos = _real(*(photo.path for photo in state.scene.photos))
    return Target(
        folder,
        scene=os.path.realpath(target) in _real(source(state), info.path),
        photo=not photos.isdisjoint(_real(target, *_written(state, target))),
    )


def fades(state: State) -> bool:
    """Whether the export leaves out, softly, what no photo looked at: as on show, unless said otherwise;
    never where the file does not say what that is."""
    form = state.exporting.form
    wanted = keeps_near(state) if form.fade is None else form.fade
    return form.what.fades and wanted and photos_known(state)


def way(state: State) -> str:
    """Of a film: along the key frames or the tour where there are some, unless said otherwise."""
    usual = "keys" if len(state.keys) > 1 else "tour" if state.tour.stops else "photos"
    return state.exporting.form.way or usual


def _colours(state: State) -> dict[str, Any]:
    """The window's own colour map and range."""
    low_high = state.heat_colours.span
    span = None if low_high is None else (_rounded(low_high[0]), _rounded(low_high[1]))
    return {"colormap": state.heat_colours.colormap, "span": span}


def _rounded(value: float) -> float:
    """To four digits, as people would type it."""
    return float(f"{value:.4g}")


def _written(state: State, target: Path) -> tuple[Path, ...]:
    """What the command writes: one file, or one a view, and what lies beside."""
    form, info = state.exporting.form, state.scene.info
    all_views = form.all_views and form.what.looks and info is not None
    return form.what.files(target, len(info.views) if all_views and info is not None else None)


def there(order: Order) -> tuple[Path, ...]:
    """Files that the order would replace."""
    return tuple(file for file in order.files if os.path.exists(file))


def _camera_file(state: State, target: Path) -> Path | None:
    """Where the view on show, or the key frames, are to be written for the command to read."""
    form = state.exporting.form
    if form.what.moves:
        return target.with_name(f"{target.stem}.keys.json") if way(state) == "keys" else None
    return target.with_name(f"{target.stem}.camera.json") if _on_show(form) else None


def _on_show(form: ExportForm) -> bool:
    """Whether what the window shows is to be written, not what photos show."""
    return form.what.looks and not form.all_views


def shape(state: State) -> float:
    """Width over height of what is written: of the view on show as the window shows it, else of a photo."""
    width, height = state.stats.picture_size
    return width / height if _on_show(state.exporting.form) and width and height else state.scene.pose.aspect


def _seen_from(state: State, camera_file: Path | None) -> dict[str, Any]:
    """The fields of a request that say where from it is looked at."""
    form = state.exporting.form
    if form.what.moves:
        return {"path": str(camera_file or way(state)), "seconds": form.seconds}
    if not form.what.looks:
        return {}
    if form.all_views:
        return {"all_views": form.what is not SEGMENTED}
    return {"camera": camera_file}


def _real(*files: Path | None) -> set[str]:
    return {os.path.realpath(file) for file in files if file is not None}


def source(state: State) -> Path | None:
    """The scene file that the command reads: the person's own, or a copy with what it does not hold."""
    form = state.exporting.form
    if form.only_selected and form.what.splats:
        return state.exporting.selection
    if state.editing.exported_anew:
        return state.exporting.edited
    return None if state.scene.info is None else state.scene.info.path or state.recovery.copy


def typed_target(form: ExportForm) -> Path | None:
    """The file, or folder, as typed, with the ending of what is written; None while it names none."""
    text = form.path.strip()
    path = typed_path(text)
    if not text or not path.name:
        return None
    ends = not form.what.suffix or path.suffix.lower() == form.what.suffix
    return path if ends else path.with_name(path.name + form.what.suffix)


def pixels(side: int, aspect: float) -> tuple[int, int]:
    """(width, height) of a picture whose longer side is `side`."""
    if aspect >= 1:
        return side, max(1, round(side / aspect))
    return max(1, round(side * aspect)), side


def _phrases(state: State) -> tuple[tuple[str, ...], str]:
    """Those that take part, and what is wrong with them."""
    what = state.exporting.form.what
    asked = tuple(prompt.text.strip() for prompt in state.asking.asked)
    if what.needs_phrases and not asked:
        return (), f"{what.label} needs a phrase; type one under Find first."
    if what.phrases == "one":
        active = state.asking.active_prompt
        return ((active.text.strip(),) if active else asked[:1]), ""
    if what is PAGE:
        return asked, ""
    wanted = what.needs_phrases or (what.takes_phrases and state.exporting.form.only_found)
    if wanted and not asked:
        return (), "There is no phrase to export the answers of; type one under Find first."
    return (asked if wanted else ()), ""


def _threshold(state: State) -> float | None:
    """The person's own threshold, where all phrases that take part share one."""
    active = state.asking.active_prompt
    part = [active] if state.exporting.form.what.phrases == "one" and active else list(state.asking.asked)
    own = {prompt.threshold for prompt in part}
    threshold = next(iter(own)) if len(own) == 1 else None
    if threshold is None or not 0.0 < threshold < 1.0:
        return None
    return _rounded(threshold)


def remarks(state: State) -> list[str]:
    """What the command cannot carry over from the window."""
    form, notes = state.exporting.form, []
    if state.scene.info is not None and source(state) != state.scene.info.path:
        unsaved = "edits are" if state.editing.exported_anew else "scene is"
        why = "selection is" if form.only_selected and form.what.splats else unsaved
        notes.append(f"The {why} not saved: the command reads a copy that is deleted when the window closes.")
    if not (form.what.needs_phrases or form.only_found):
        return notes
    if form.what.phrases != "one" and len({prompt.threshold for prompt in state.asking.asked}) > 1:
        notes.append("The thresholds differ, so the calibrated one is used for all.")
    if state.asking.negatives:
        notes.append("The export compares phrases with the default ones, not with your own.")
    return notes
