"""Every command that has a name: keys, menu, palette and help are made of this one table.

Beside those that are always there: what can be opened without a look for it.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from imgui_bundle import icons_fontawesome_6 as fa
from imgui_bundle import imgui

from langflash_core.base.pictures import KEYED, PICTURES, Picture

from .. import commands as do
from ..asking import commands as ask
from ..asking import lifting
from ..asking.prompt_sets import MOST_PROMPTS
from ..dialogs import Dialog
from ..editing import cleaning as clean
from ..editing import commands as edit
from ..editing import mending, placing, things
from ..editing import pointing as point
from ..editing import teaching as teach
from ..editing.state import Handle, Tool
from ..exporting import commands as export
from ..filming import commands as film
from ..inventory import commands as take
from ..opening import commands as opening
from ..recovery import commands as keep
from ..scene import camera, samples
from ..scene import commands as show
from ..scene.panels import in_space
from ..scene.standing import LevelScene
from ..scene.state import possible
from ..state import State
from ..touring import commands as tour

BRUSH_STEP = 1.15  # of its radius, per press of [ or ]
ORBIT_STEP = math.radians(5.0)
_DIGITS = "1234567890"
_SIDE_KEYS = {"the front": "keypad1", "the right": "keypad3", "above": "keypad7"}
_SIGNS = {
    imgui.Key.comma: ",", imgui.Key.left_bracket: "[", imgui.Key.right_bracket: "]",
    imgui.Key.left_arrow: "Left", imgui.Key.right_arrow: "Right", imgui.Key.up_arrow: "Up",
    imgui.Key.down_arrow: "Down", imgui.Key.page_up: "PgUp", imgui.Key.page_down: "PgDn",
    imgui.Key.delete: "Del", imgui.Key.backspace: "Backspace", imgui.Key.home: "Home",
    imgui.Key.keypad1: "Num 1", imgui.Key.keypad3: "Num 3", imgui.Key.keypad5: "Num 5",
    imgui.Key.keypad7: "Num 7", imgui.Key.keypad4: "Num 4", imgui.Key.keypad6: "Num 6",
    imgui.Key.keypad8: "Num 8", imgui.Key.keypad2: "Num 2",
}  # fmt: skip


@dataclass(frozen=True)
class Chord:
    """A key with or without Ctrl and Shift."""

    key: imgui.Key
    ctrl: bool = False
    shift: bool = False

    def __str__(self) -> str:
        held = "Ctrl+" * self.ctrl + "Shift+" * self.shift
        sign = _SIGNS.get(self.key, str(self.key.name).strip("_").upper())
        return held + ("Comma" if sign == "," and not held else sign)


@dataclass(frozen=True)
class Entry:
    """A command by its name. make: it for a state, or None where it has nothing to do.

    in_fields: its keys work while a text field has the others. repeats: while the key is held.
    """

    name: str
    group: str
    make: Callable[[State], do.Command | None]
    keys: tuple[Chord, ...] = ()
    icon: str = ""
    in_fields: bool = False
    repeats: bool = False

    @property
    def key(self) -> str:
        """Its first key, for people; empty without one."""
        return str(self.keys[0]) if self.keys else ""


def named(name: str) -> Entry:
    """The entry of this name."""
    return next(entry for entry in ENTRIES if entry.name == name)


def matching(text: str, state: State) -> tuple[Entry, ...]:
    """Entries with every word of `text` in group or name; names that begin with it come first."""
    words, start = text.lower().split(), text.lower().strip()
    entries = (*ENTRIES, *recent(state), *sample_photos())
    found = [e for e in entries if all(word in f"{e.group} {e.name}".lower() for word in words)]
    return tuple(sorted(found, key=lambda entry: not entry.name.lower().startswith(start)))


def recent(state: State) -> Iterable[Entry]:
    """The scenes that were open last, the newest first."""
    for path in state.preferences.recent:
        yield Entry(Path(path).name, "Recent scenes", _always(keep.OpenProject(path)))


def sample_photos() -> Iterable[Entry]:
    """Pairs that come with the program, each a room of its own."""
    for label, photos in samples.pairs():
        yield Entry(label, "Sample photos", _always(show.try_out(photos)))


def _plain(name: str) -> tuple[Chord, ...]:
    return (Chord(getattr(imgui.Key, name)),)


def _ctrl(name: str, shift: bool = False) -> tuple[Chord, ...]:
    return (Chord(getattr(imgui.Key, name), ctrl=True, shift=shift),)


def _always(command: do.Command) -> Callable[[State], do.Command | None]:
    return lambda state: command


def _made(make: Callable[[State], do.Command]) -> Callable[[State], do.Command | None]:
    """Once there is a scene."""
    return lambda state: make(state) if state.scene.info is not None else None


def _shown(command: do.Command) -> Callable[[State], do.Command | None]:
    """Once there is a scene, the same for all."""
    return _made(lambda _: command)


def _selected(command: do.Command) -> Callable[[State], do.Command | None]:
    """Once something is selected."""
    return lambda state: command if state.editing.num_selected else None


def _files() -> Iterable[Entry]:
    group, dialog = "File", do.ShowDialog
    looking = _always(opening.OpenFiles())
    yield Entry("Open ...", group, looking, _ctrl("o"), fa.ICON_FA_FOLDER_OPEN, in_fields=True)
    yield Entry("Frames of the film ...", group, _frames, icon=fa.ICON_FA_FILM)
    yield Entry("Paste photos", group, _always(opening.Paste()), _ctrl("v"), fa.ICON_FA_PASTE)
    saving, disk, exporting = _shown(dialog(Dialog.SAVE)), fa.ICON_FA_FLOPPY_DISK, fa.ICON_FA_FILE_EXPORT
    yield Entry("Save ...", group, saving, _ctrl("s"), disk, in_fields=True)
    yield Entry("Export ...", group, _shown(export.ShowExport()), _ctrl("e"), exporting, in_fields=True)
    merging = _shown(opening.OpenFiles(merging=True))
    yield Entry("Merge a scene into this one ...", group, merging, _ctrl("m"), fa.ICON_FA_OBJECT_GROUP)
    reconstruct = show.Instead((show.Reconstruct(),))
    yield Entry("Reconstruct the photos", group, lambda s: reconstruct if s.scene.photos else None)
    yield Entry("Back to the previous room", group, _room_before)
    yield Entry("Pause the reconstruction", group, _pause)
    yield Entry("Cancel the reconstruction", group, lambda s: show.CancelJob() if s.scene.job else None)
    yield Entry("Keep only the two best photos", group, _pair)
    yield Entry("Put back the photos that were removed", group, _photos_back)
    clearing = lambda s: show.ClearPhotos() if s.scene.photos and not s.scene.job else None  # noqa: E731
    yield Entry("Clear the tray", group, clearing)
    yield Entry("Quit", group, _always(do.Leave()), _ctrl("q"), fa.ICON_FA_RIGHT_FROM_BRACKET, in_fields=True)


def _frames(state: State) -> do.Command | None:
    free = state.opening.film is not None and state.scene.job is None
    return do.ShowDialog(Dialog.FILM) if free else None


def _pair(state: State) -> do.Command | None:
    scene = state.scene
    return show.ChoosePair() if len(scene.photos) > 2 and scene.job is None and not scene.choosing else None


def _photos_back(state: State) -> do.Command | None:
    return show.PutPhotosBack() if state.scene.num_taken_out and not state.scene.choosing else None


def _pause(state: State) -> do.Command | None:
    job = state.scene.job
    return show.PauseJob() if job is not None and job.pausable and not job.cancelling else None


def _room_before(state: State) -> do.Command | None:
    free = state.scene.rooms and state.scene.job is None
    return show.GoToRoom(state.scene.rooms[0].info.serial) if free else None


def _program() -> Iterable[Entry]:
    group, dialog = "Program", do.ShowDialog
    palette = fa.ICON_FA_TERMINAL
    yield Entry("All commands", group, _always(dialog(Dialog.PALETTE)), _ctrl("p"), palette, in_fields=True)
    settings = _always(dialog(Dialog.SETTINGS))
    yield Entry("Preferences", group, settings, _ctrl("comma"), fa.ICON_FA_GEAR, in_fields=True)
    yield Entry("Log", group, _always(dialog(Dialog.LOG)), _plain("f2"), fa.ICON_FA_LIST, in_fields=True)
    help_ = _always(dialog(Dialog.HELP))
    yield Entry("Mouse and keys", group, help_, _plain("f1"), fa.ICON_FA_KEYBOARD, in_fields=True)


def _asking() -> Iterable[Entry]:
    group = "Find"
    yield Entry("Type a phrase", group, _always(ask.FocusPhrase()), _ctrl("f"), in_fields=True)
    adding = lambda s: ask.AddPrompt() if len(s.asking.prompts) < MOST_PROMPTS else None  # noqa: E731
    yield Entry("Add a phrase", group, adding)
    yield Entry("Select what the phrase found", group, _meant)
    yield Entry("Save the phrases ...", group, _always(do.ShowDialog(Dialog.SAVE_PROMPTS)))
    yield Entry("Load phrases ...", group, _always(do.ShowDialog(Dialog.LOAD_PROMPTS)))
    yield Entry("Dictionary", group, _spoken(lambda s: ask.OpenDictionary(not s.preferences.dictionary_open)))
    teaching = lambda s: lifting.TeachPhrases() if lifting.can_learn(s) else None  # noqa: E731
    yield Entry("Teach this file to answer phrases (lift)", group, teaching)
    yield Entry("Keep names for other scenes", group, _spoken(lambda _: teach.KeepWords()))
    yield Entry("Take names from other scenes", group, _spoken(lambda _: teach.TakeWords()))


def _meant(state: State) -> do.Command | None:
    prompt = state.asking.active_prompt if state.scene.info is not None else None
    return None if prompt is None else edit.SelectByPhrase(prompt.key, state.editing.combine)


def _spoken(make: Callable[[State], do.Command]) -> Callable[[State], do.Command | None]:
    """Once there is a scene with groups."""
    return lambda state: make(state) if state.scene.info is not None and state.scene.info.num_atoms else None


def _looking() -> Iterable[Entry]:
    group = "View"
    home = (*_plain("h"), *_plain("home"))
    yield Entry("Back to the first photo's view", group, _shown(camera.Home()), home)
    yield Entry("Show all of the scene", group, _shown(camera.FrameAll()), _plain("z"))
    yield Entry("Fly to the selection", group, _shown(point.FrameSelection()), _plain("f"))
    yield Entry("Compare with the photo", group, _compare, _plain("p"))
    yield Entry("Show the photos' cameras", group, _switched("photos_in_space"), _plain("k"))
    names = _made(lambda s: ask.NameThings(not s.asking.named))
    yield Entry("Names of things in the picture", group, names, _plain("n"))
    yield Entry("Stay near the photos", group, _switched("near_photos"))
    yield Entry("Fill gaps from what is around them", group, _switched("fill_gaps"))
    yield Entry("Grid on the floor", group, _switched("floor_grid"))
    for side, forward in camera.SIDES:
        keys = _plain(_SIDE_KEYS[side]) if side in _SIDE_KEYS else ()
        yield Entry(f"Look from {side}", group, _shown(camera.Face(forward)), keys)
    for way, pad, yaw, pitch in (("left", 4, -1, 0), ("right", 6, 1, 0), ("up", 8, 0, -1), ("down", 2, 0, 1)):
        keys = (*_plain(f"keypad{pad}"), *_ctrl(f"{way}_arrow", shift=True))
        turn = camera.Orbit(ORBIT_STEP * yaw, ORBIT_STEP * pitch)
        yield Entry(f"Orbit: {way}", group, _shown(turn), keys, repeats=True)
    rays = (*_plain("comma"), *_plain("keypad5"))
    yield Entry("Parallel rays (orthographic), or perspective", group, _shown(camera.SwitchRays()), rays)
    yield Entry("Add a key frame", group, _shown(film.AddKey()), _plain("m"))
    yield Entry("Remove the last key frame", group, lambda s: film.RemoveKey() if s.keys else None)
    yield Entry("Fly along the key frames", group, _shown(film.Preview()), _plain("j"))
    listing, list_ = _made(lambda s: take.ShowInventory(not s.listing.open)), fa.ICON_FA_LIST_CHECK
    yield Entry("Inventory: what is in the room", group, listing, _ctrl("l"), list_, in_fields=True)
    touring = _made(lambda s: tour.ShowTour(not s.touring.open))
    yield Entry("Tour: stops and notes", group, touring, icon=fa.ICON_FA_SIGNS_POST)
    yield Entry("Tour: add this view as a stop", group, _shown(tour.AddStop()))
    for name, command, keys in (
        ("play", tour.Play(), ()),
        ("next stop", tour.Step(1), _plain("page_down")),
        ("previous stop", tour.Step(-1), _plain("page_up")),
    ):
        yield Entry(f"Tour: {name}", group, _toured(command), keys)
    for mode in PICTURES:
        keys = _plain(f"_{_DIGITS[KEYED.index(mode)]}") if mode in KEYED else ()
        yield Entry(f"Show: {mode.label}", group, _mode(mode), keys)


def _toured(command: do.Command) -> Callable[[State], do.Command | None]:
    """Once there are stops."""
    return lambda state: command if state.tour.stops else None


def _mode(mode: Picture) -> Callable[[State], do.Command | None]:
    return lambda state: camera.SetMode(mode) if possible(mode, state.scene.info) else None


def _compare(state: State) -> do.Command | None:
    if state.scene.info is None or state.scene.view is None:
        return None
    return camera.Compare(None if in_space.comparing(state) else 0.5)


def _switched(name: str) -> Callable[[State], do.Command | None]:
    """A preference on or off, by its name: once there is a scene, for the grid one that stands."""

    def make(state: State) -> do.Command | None:
        there = state.scene.info if name != "floor_grid" else state.world
        wanted = state.preferences
        return None if there is None else keep.Prefer(replace(wanted, **{name: not getattr(wanted, name)}))

    return make


def _tools() -> Iterable[Entry]:
    group = "Tools"
    for name, key, tool in (
        ("Move around", "v", Tool.MOVE), ("What is this?", "x", Tool.POINT),
        ("Select with a box", "r", Tool.BOX), ("Select with a lasso", "l", Tool.LASSO),
        ("Select with a brush", "b", Tool.BRUSH), ("Select with a ball", "o", Tool.SPHERE),
        ("Select the thing under a click", "c", Tool.PICK), ("Measure", "t", Tool.RULER),
    ):  # fmt: skip
        yield Entry(name, group, _shown(point.SetTool(tool)), _plain(key))
    yield Entry("Clone brush", group, _shown(point.SetTool(Tool.CLONE)), _ctrl("b"))
    for name, key, handle in (
        ("Move the selection", "y", Handle.MOVE), ("Turn the selection", "u", Handle.TURN),
        ("Scale the selection", "i", Handle.SCALE),
    ):  # fmt: skip
        yield Entry(name, group, _shown(placing.SetHandle(handle)), _plain(key))
    less, more = _amount(1 / BRUSH_STEP, -1), _amount(BRUSH_STEP, 1)
    yield Entry("A smaller brush, or less of a thing", group, less, _plain("left_bracket"), repeats=True)
    yield Entry("A larger brush, or more of a thing", group, more, _plain("right_bracket"), repeats=True)
    yield Entry("Clean up", group, _shown(edit.FindFloaters()))
    yield Entry("Clean up: by rules, or outside a box", group, _shown(clean.ShowRules()))
    yield Entry("Clean up: load a recipe ...", group, _shown(do.ShowDialog(Dialog.LOAD_RECIPE)))


def _amount(factor: float, steps: int) -> Callable[[State], do.Command | None]:
    """Of the thing that was clicked, or else of the brush."""

    def make(state: State) -> do.Command | None:
        if state.editing.tool is Tool.PICK and state.editing.reached is not None:
            return things.StepLevel(steps)
        return point.SetRadius(state.editing.radius * factor) if state.scene.info is not None else None

    return make


def _editing() -> Iterable[Entry]:
    group = "Edit"
    yield Entry("Undo", group, _undo, _ctrl("z"))
    yield Entry("Level the scene", group, _shown(LevelScene()), icon=fa.ICON_FA_SCALE_BALANCED)
    yield Entry("Redo", group, _redo, (*_ctrl("z", shift=True), *_ctrl("y")))
    yield Entry("Select everything", group, _shown(edit.SelectAll()), _ctrl("a"))
    yield Entry("Select nothing", group, _selected(edit.Deselect()), _ctrl("d"))
    yield Entry("Select the rest", group, _shown(edit.Invert()), _ctrl("i"))
    yield Entry("Grow the selection", group, _selected(edit.Grow()), _plain("g"))
    deleting = (*_plain("delete"), *_plain("backspace"))
    yield Entry("Delete the selection", group, _selected(edit.Delete()), deleting)
    yield Entry("Delete the selection and fill the hole", group, _selected(mending.FillSelection()))
    yield Entry("Copy the selection", group, _selected(mending.CopySelection()), _ctrl("j"))
    yield Entry("Hide the selection for good", group, _selected(mending.AskToHide()))
    yield Entry("Recolour the selection", group, _recolour, _ctrl("t"))
    for name, key, nudge in (
        ("left", "left_arrow", placing.Nudge(right=-1)), ("right", "right_arrow", placing.Nudge(right=1)),
        ("up", "up_arrow", placing.Nudge(down=-1)), ("down", "down_arrow", placing.Nudge(down=1)),
        ("away", "page_up", placing.Nudge(ahead=1)), ("nearer", "page_down", placing.Nudge(ahead=-1)),
    ):  # fmt: skip
        yield Entry(f"Nudge the selection: {name}", group, _placing(nudge), _ctrl(key))
    yield Entry("Hide the selection", group, _selected(edit.Hide()))
    yield Entry("Show the selection alone", group, _selected(edit.Isolate()))
    yield Entry("Show what is hidden", group, _shown(edit.ShowAll()))


def _recolour(state: State) -> do.Command | None:
    """Choose a colour; once more: it is the one."""
    if state.editing.tint is not None:
        return placing.EndGesture()
    return placing.BeginTint() if state.editing.num_selected else None


def _placing(command: do.Command) -> Callable[[State], do.Command | None]:
    """Once the gizmo has something to move."""
    return lambda state: command if state.editing.placing else None


def _undo(state: State) -> do.Command | None:
    """Of what was done last: photos come back before edits that are older."""
    back, taken, history = _photos_back(state), state.scene.taken_out, state.editing.history
    if taken is not None and taken.history is history and back is not None:
        return back
    if history and history.done:
        return edit.Undo()
    if state.scene.mute is not None:
        return lifting.ForgetPhrases()
    return mending.BringBack() if state.scene.unhidden is not None else back


def _redo(state: State) -> do.Command | None:
    return edit.Redo() if state.editing.history and state.editing.history.undone else None


ENTRIES: tuple[Entry, ...] = (*_files(), *_asking(), *_looking(), *_tools(), *_editing(), *_program())
