"""The command line that does what the export dialog says.

The window runs that very command in a process of its own, so what is shown is what is done.
"""

import os
import shlex
from dataclasses import dataclass
from pathlib import Path

from langflash_core.formats import COLOUR_MAPS

from ..scene.drops import typed_path
from ..scene.near import fills_gaps, keeps_near, photos_known
from ..state import State
from .state import ExportForm, What


@dataclass(frozen=True)
class Order:
    """What the dialog comes to: the words after `langflash`, a camera file to write first, and all files
    that will be written."""

    words: tuple[str, ...]
    target: Path
    camera_file: Path | None = None
    files: tuple[Path, ...] = ()

    @property
    def line(self) -> str:
        """To paste into a shell."""
        return shlex.join(("langflash", *self.words))


def order(state: State) -> Order | str:
    """The command for the form as it stands, or a sentence that says what is missing."""
    form, info = state.exporting.form, state.info
    if info is None:
        return "There is no scene to export; drop photos on the window first."
    scene_file = source(state)
    if scene_file is None:
        return "The scene has no file yet; save it first."
    target = typed_target(form)
    if target is None:
        return "Type a file name."
    if os.path.realpath(target) in _real(scene_file, info.path):
        return "This file is the scene itself; choose another name."
    if _real(target, *_written(form, target, len(info.views))) & _real(*(p.path for p in state.photos)):
        return "This would replace a photo of the tray; choose another name."
    phrases, problem = _phrases(state)
    if problem:
        return problem
    words = ["export", str(scene_file), "-o", str(target)]
    if form.what is What.SEGMENTED:
        words.append("--segmented")
    if form.what.word:
        words += ["--what", form.what.word]
    if phrases:
        words += ["--prompt", *phrases, *_threshold(state)]
    if fades(state):
        words.append("--fade")
    if form.what.fills and fills_gaps(state) and (form.what.of_one_phrase or not phrases):
        words.append("--fill")
    if form.what in (What.HEAT, What.HEAT_VIDEO):
        words += _colours(state)
    seen_from, camera_file = _seen_from(state, target)
    words += seen_from
    if form.what.sized:
        words += ["--size", "{}x{}".format(*pixels(form.side, state.pose.aspect))]
    if form.what.film:
        if way(state) == "keys":
            if len(state.keys) < 2:
                return "A film along key frames needs two of them; fly somewhere and add one (M)."
            camera_file = target.with_name(f"{target.stem}.keys.json")
        words += ["--path", str(camera_file) if way(state) == "keys" else way(state)]
        words += ["--seconds", f"{form.seconds:g}"]
    files = (*_written(form, target, len(info.views)), *((camera_file,) if camera_file else ()))
    return Order(tuple(words), target, camera_file, files)


def fades(state: State) -> bool:
    """Whether the export leaves out, softly, what no photo looked at: as on show, unless said otherwise;
    never where the file does not say what that is."""
    form = state.exporting.form
    wanted = keeps_near(state) if form.fade is None else form.fade
    return form.what.fades and wanted and photos_known(state)


def way(state: State) -> str:
    """Of a film: along the key frames where there are some, unless said otherwise."""
    return state.exporting.form.way or ("keys" if len(state.keys) > 1 else "photos")


def _colours(state: State) -> list[str]:
    """The window's own colour map and range."""
    colours, words = state.heat_colours, []
    if colours.colormap != COLOUR_MAPS[0]:
        words += ["--colormap", colours.colormap]
    if colours.span is not None:
        words += ["--span", "{:.4g},{:.4g}".format(*colours.span)]
    return words


def _written(form: ExportForm, target: Path, num_views: int) -> tuple[Path, ...]:
    """What the command writes: one file, or one a view, and what lies beside."""
    what, views = form.what, range(num_views if form.all_views else 1)
    if what is What.COCO:
        return (target, *(target.with_name(f"{target.stem}_{view}.png") for view in views))
    if what is What.PLY:
        return target, target.with_name(f"{target.stem}.language.safetensors")
    pictures = (target,)
    if form.all_views and what.looks and what.suffix == ".png":
        pictures = tuple(target.with_name(f"{target.stem}_{view}.png") for view in views)
    with_legend = what in (What.LABELS, What.INSTANCES)
    legends = (picture.with_suffix(".json") for picture in pictures if with_legend)
    return (*pictures, *legends)


def there(order: Order) -> tuple[Path, ...]:
    """Files that the order would replace."""
    return tuple(file for file in order.files if os.path.exists(file))


def _seen_from(state: State, target: Path) -> tuple[list[str], Path | None]:
    """The words that say where from it is looked at, and the camera file that they name, if any."""
    form = state.exporting.form
    if not form.what.looks:
        return [], None
    if form.all_views:
        return ([] if form.what is What.SEGMENTED else ["--all-views"]), None
    if state.view is not None:
        return ["--view", str(state.view)], None
    camera_file = target.with_name(f"{target.stem}.camera.json")
    return ["--camera", str(camera_file)], camera_file


def _real(*files: Path | None) -> set[str]:
    return {os.path.realpath(file) for file in files if file is not None}


def source(state: State) -> Path | None:
    """The scene file that the command reads: the person's own, or a copy with what it does not hold."""
    form = state.exporting.form
    if form.only_selected and form.what.splats:
        return state.exporting.selection
    if state.editing.exported_anew:
        return state.exporting.edited
    return None if state.info is None else state.info.path or state.recovery.copy


def typed_target(form: ExportForm) -> Path | None:
    """The file, or folder, as typed, with the ending of what is written; None while it names none."""
    text = form.path.strip()
    path = typed_path(text)
    if not text or not path.name or (os.path.isdir(path) and form.what.suffix):
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
    asked = tuple(prompt.text.strip() for prompt in state.asked)
    if what.needs_phrases and not asked:
        return (), f"{what.label} needs a phrase; type one under Find first."
    if what.of_one_phrase:
        active = state.active_prompt
        return ((active.text.strip(),) if active else asked[:1]), ""
    if what is What.PAGE:
        return asked, ""
    wanted = what.needs_phrases or (what.takes_phrases and state.exporting.form.only_found)
    if wanted and not asked:
        return (), "There is no phrase to keep only the answers of; type one under Find first."
    return (asked if wanted else ()), ""


def _threshold(state: State) -> list[str]:
    """The person's own threshold, where all phrases that take part share one."""
    active = state.active_prompt
    part = [active] if state.exporting.form.what.of_one_phrase and active else list(state.asked)
    own = {prompt.threshold for prompt in part}
    threshold = next(iter(own)) if len(own) == 1 else None
    if threshold is None or not 0.0 < threshold < 1.0:
        return []
    return ["--threshold", f"{threshold:.4g}"]


def remarks(state: State) -> list[str]:
    """What the command cannot carry over from the window."""
    form, notes = state.exporting.form, []
    if state.info is not None and source(state) != state.info.path:
        unsaved = "edits are" if state.editing.exported_anew else "scene is"
        why = "selection is" if form.only_selected and form.what.splats else unsaved
        notes.append(f"The {why} not saved: the command reads a copy that goes when the window closes.")
    if not (form.what.needs_phrases or form.only_found):
        return notes
    if not form.what.of_one_phrase and len({prompt.threshold for prompt in state.asked}) > 1:
        notes.append("The thresholds differ, so the calibrated one is used for all.")
    if state.negatives:
        notes.append("Phrases are compared with the usual ones, not with your own.")
    return notes
