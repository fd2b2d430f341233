"""Our own dialog for files: folders to walk through, photos as small pictures, several at once."""

import os
import zlib
from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...dialogs import Dialog
from ...kit import theme, widgets
from ...kit.look import Look
from ...scene import commands as show
from ...scene.drops import There, typed_path
from ...scene.merging import MergeScene
from ...state import State
from .. import commands as opening
from ..state import Folder, small

WIDTH = 760.0  # design pixels
_HEIGHT, _CELL = 330.0, 132.0
_HINTS = {
    Dialog.OPEN: "type a scene, photo, film or folder, or choose below",
    Dialog.MERGE: "type a scene or a folder, or choose below",
    Dialog.PLACE: "type a folder, or choose one below",
}


def draw(state: State, look: Look) -> list[do.Command]:
    """The dialog's body."""
    issued, confirmed = _path(state)
    folder = state.opening.folder
    if folder is None:
        widgets.muted("Reading the folder ...")
    else:
        issued += _way(folder, look)
    shape = imgui.ChildFlags_.borders | imgui.ChildFlags_.nav_flattened  # keys walk in without a key for it
    height = min(look.px(_HEIGHT), widgets.above_buttons(look.px(24), look.px(60)))
    imgui.begin_child("##files", ImVec2(0, height), shape)
    if folder is not None:
        keys = imgui.get_io().nav_visible and not state.typed.text
        if _walked(folder) and keys:  # what had the keys went with the folder before
            imgui.set_keyboard_focus_here()
        issued += _inside(state, folder, look)
    imgui.end_child()
    return issued + (_place_buttons if state.dialog is Dialog.PLACE else _buttons)(state, confirmed, look)


def _path(state: State) -> tuple[list[do.Command], bool]:
    """A path to type; the second value tells whether Enter was pressed."""
    imgui.set_next_item_width(-1)
    if imgui.is_window_appearing():
        imgui.set_keyboard_focus_here()
    hint = _HINTS[state.dialog or Dialog.OPEN]
    changed, path = imgui.input_text_with_hint("##path", hint, state.typed.text)
    confirmed = widgets.confirmed()
    return ([do.EditDialogPath(path)] if changed else []), confirmed


def _way(folder: Folder, look: Look) -> list[do.Command]:
    """Up, home, and the folders on the way here, a button each."""
    issued: list[do.Command] = []
    up = opening.LookInto(folder.path.parent)
    issued += widgets.press(f"{fa.ICON_FA_ARROW_UP}##up", up, "Parent folder")
    imgui.same_line(0, look.px(4))
    issued += widgets.press(f"{fa.ICON_FA_HOUSE}##home", opening.LookInto(Path.home()))
    for parent in (*reversed(folder.path.parents[:3]), folder.path):
        name = widgets.shortened(parent.name or str(parent), look.px(150))
        widgets.beside(widgets.button_width(name), look.px(2))
        issued += widgets.press(f"{name}##{parent}", opening.LookInto(parent), quiet=True)
    return issued


def _inside(state: State, folder: Folder, look: Look) -> list[do.Command]:
    """Folders, scenes, then photos as a grid: those that begin as what is typed."""
    issued: list[do.Command] = []
    begun = _begun(state, folder)
    folders, scenes, films, photos = (
        tuple(path for path in some if path.name.lower().startswith(begun.lower()))
        for some in (
            folder.folders,
            () if state.dialog is Dialog.PLACE else folder.scenes,
            *((folder.films, folder.photos) if state.dialog is Dialog.OPEN else ((), ())),
        )
    )
    if folder.problem:
        widgets.muted(folder.problem)
    for path in folders:
        if imgui.selectable(f"{fa.ICON_FA_FOLDER}  {path.name}##{path}", False)[0] and not _again():
            issued.append(opening.LookInto(path))
    for path in (*scenes, *films):
        chosen, icon = path in state.opening.chosen, fa.ICON_FA_FILM if path in films else fa.ICON_FA_CUBES
        if imgui.selectable(f"{icon}  {path.name}##{path}", chosen)[0] and not _again():
            issued.append(_taken(state, path))
    gap, room = look.px(8), imgui.get_content_region_avail().x + look.px(8)
    columns = max(int(room / (look.px(_CELL) + gap)), 1)
    for place, path in enumerate(photos):
        if place % columns:
            imgui.same_line(0, gap)
        issued += _photo(state, path, ImVec2(room / columns - gap, look.px(_CELL)), look)
    if folder.left_out:
        widgets.muted(f"and {folder.left_out} more; type a path to open one of them")
    if folder.unsaid:
        widgets.muted(f"and {folder.unsaid} with names that are not UTF-8; rename them")
    if not (folders or photos or films or scenes or folder.problem):
        nothing = "No folders here." if state.dialog is Dialog.PLACE else "Nothing to open here."
        widgets.muted(f'Nothing here begins with "{begun}".' if begun else nothing)
    return issued


def _begun(state: State, folder: Folder) -> str:
    """The name in this folder that is being typed; "" where none is, or the whole folder is meant."""
    path = typed_path(state.typed.text, folder.path)
    inside = path.parent == folder.path and path != folder.path and state.typed.there is not There.FOLDER
    return path.name if state.typed.text.strip() and inside else ""


def _walked(folder: Folder) -> bool:
    """Whether another folder was on show in the frame before, in this dialog."""
    storage, key = imgui.get_state_storage(), imgui.get_id("folder")
    before, now = storage.get_int(key), zlib.crc32(bytes(folder.path))
    storage.set_int(key, now & 0x7FFFFFFF)
    return before not in (0, now & 0x7FFFFFFF)


def _photo(state: State, path: Path, size: ImVec2, look: Look) -> list[do.Command]:
    """A card with the photo and its name; a click takes it with the others."""
    chosen = path in state.opening.chosen
    corner = imgui.get_cursor_screen_pos()
    line = imgui.get_text_line_height()
    pressed = imgui.selectable(f"##{path}", chosen, imgui.SelectableFlags_.no_auto_close_popups, size)[0]
    if not imgui.is_item_visible():
        return []
    canvas, picture = imgui.get_window_draw_list(), look.thumbnails.get(small(path))
    room = ImVec2(size.x - look.px(12), size.y - line - look.px(14))
    if picture is not None:
        width = min(room.x, room.y * picture[1])
        height = width / picture[1]
        at = ImVec2(corner.x + (size.x - width) / 2, corner.y + look.px(6) + (room.y - height) / 2)
        canvas.add_image(picture[0], at, ImVec2(at.x + width, at.y + height))
    name = widgets.shortened(path.name, room.x)
    at = ImVec2(corner.x + look.px(6), corner.y + size.y - line - look.px(4))
    canvas.add_text(at, widgets.u32(theme.TEXT if chosen else theme.MUTED), name)
    if chosen:
        end = ImVec2(corner.x + size.x, corner.y + size.y)
        canvas.add_rect(corner, end, widgets.u32(theme.ACCENT), look.px(4), look.px(2))
    return [_taken(state, path)] if pressed and not _again() else []


def _taken(state: State, path: Path) -> do.Command:
    """What a press on a file comes to: Enter opens it and what is chosen, the space bar and the mouse take it
    with the others."""
    return _opened(state, (*state.opening.chosen, path)) if widgets.enters() else opening.Choose(path)


def _opened(state: State, paths: tuple[Path, ...]) -> do.Command:
    """Open files, each once; or merge the last of them."""
    if state.dialog is Dialog.MERGE:
        return MergeScene(paths[-1])
    return show.OpenPaths(tuple(map(str, dict.fromkeys(paths))))


def _again() -> bool:
    """Whether the press was the second of a double click: it would walk into what the first one brought under
    the pointer, or let go of what that one took."""
    return imgui.is_mouse_released(0) and imgui.get_io().mouse_clicked_last_count[0] > 1


def _buttons(state: State, confirmed: bool, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    typed, chosen, folder = state.typed.text.strip(), state.opening.chosen, state.opening.folder
    path = typed_path(typed, None if folder is None else folder.path)
    walks = bool(typed) and _walks(state, path)
    merging = state.dialog is Dialog.MERGE
    label = "Look inside" if walks else "Merge" if merging else _opens(state, path)
    imgui.begin_disabled(not typed and not chosen)
    pressed = widgets.default_button(f"{label}###open", look.vec(140, 0), confirmed)
    imgui.end_disabled()
    imgui.same_line()
    issued += widgets.press("Cancel", do.ShowDialog(None), size=look.vec(110, 0))
    told = "Enter merges" if merging else "Space selects several, Enter opens"
    widgets.beside(imgui.calc_text_size(told).x, look.px(14))
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, told)
    if typed and pressed:
        merge_or_open = MergeScene(path) if merging else show.OpenPaths((str(path),))
        issued.append(opening.LookInto(path) if walks else merge_or_open)
    elif chosen and pressed:
        issued.append(_opened(state, chosen))
    return issued


def _walks(state: State, path: Path) -> bool:
    """Whether the folder that is typed is to be looked into: it has no photos of a room, a separator ends it,
    or it is not on show yet."""
    if state.typed.there is not There.FOLDER:
        return False
    shown = state.opening.folder
    photos = shown is not None and shown.path == path and shown.photos and state.dialog is Dialog.OPEN
    return not photos or state.typed.text.strip().endswith(os.sep)


def _opens(state: State, path: Path) -> str:
    """What the button says that opens the path that is typed, or what is chosen."""
    shown, count = state.opening.folder, len(state.opening.chosen)
    if state.typed.text.strip():
        whole = shown is not None and state.typed.there is There.FOLDER and shown.path == path
        count = len(shown.photos) if shown is not None and whole else 1
        return f"Open {count} photos" if count > 1 else "Open"
    return "Open" if count < 2 else f"Open {count} files"


def _place_buttons(state: State, confirmed: bool, look: Look) -> list[do.Command]:
    """Of the dialog for a folder to write to: the one that was typed, or the one on show."""
    folder, typed = state.opening.folder, state.typed.text.strip()
    imgui.begin_disabled(folder is None or bool(folder.problem and not typed))
    pressed = widgets.default_button("Write here", look.vec(140, 0), confirmed)
    imgui.end_disabled()
    imgui.same_line()
    if imgui.button("Back", look.vec(110, 0)):
        return [opening.PlaceFound(None)]
    wanted = typed_path(typed, None if folder is None else folder.path)
    if typed and confirmed and folder is not None and wanted != folder.path:
        return [opening.LookInto(wanted)]
    if pressed and folder is not None:
        return [opening.PlaceFound(wanted if typed else folder.path)]
    return []
