"""The empty window: a picture that is a button, scenes to go on with, samples to try; and the photos at work
on."""

from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...recovery import commands as keep
from ...recovery.state import Kept
from ...scene import samples
from ...scene.commands import try_out
from ...scene.drops import SCENE_SUFFIX
from ...scene.state import RECONSTRUCTING, said
from ...state import State
from .. import commands as opening
from ..state import sample

_TILE = (150.0, 100.0)  # design pixels
_CAPTION = 62.0  # below a tile that has three lines, design pixels
_TITLE, _SAMPLES = 176.0, 142.0  # what stands above the tiles, and tiles of samples with their names
_WORDS = 34.0  # samples as words
_GAP = 12.0


def working(state: State) -> bool:
    """Whether the photos at work on are to be seen instead of a scene that is not theirs."""
    job = state.scene.job
    ours = job is not None and job.title == RECONSTRUCTING and bool(state.scene.photos)
    return ours and (state.scene.info is None or state.scene.aside is not None)


def waits(state: State) -> bool:
    """Whether there is nothing on show yet, so that something can be opened here, by the keys too."""
    return state.scene.info is None and state.scene.job is None


def draw(state: State, look: Look, corner: ImVec2, size: ImVec2) -> list[do.Command]:
    """On the canvas at `corner` while there is no scene."""
    if state.scene.job is not None:
        doing = f"{state.scene.job.title}: {said(state.scene.job.stage)}"
        _line(doing, ImVec2(corner.x + size.x / 2, corner.y + size.y / 2))
        return []
    if state.scene.info is not None:  # its first picture is on its way
        return []
    rows = _rows(state, size, look)
    tall = _TITLE + (len(rows) * (_TILE[1] + _CAPTION) + _WORDS if rows else _SAMPLES)
    top = corner.y + max((size.y - look.px(tall)) / 2, look.px(12))
    middle = corner.x + size.x / 2
    _line(fa.ICON_FA_CUBES, ImVec2(middle, top + look.px(40)), theme.LINE, 3.0)
    title, hint = invitation(len(state.scene.photos))
    _line(title, ImVec2(middle, top + look.px(72)), theme.TEXT, 1.25)
    _line(hint, ImVec2(middle, top + look.px(98)))
    issued = _buttons(ImVec2(middle, top + look.px(112)), look)
    below = ImVec2(middle, top + look.px(_TITLE))
    if rows:
        issued += _projects(rows, below, look)
        below = ImVec2(middle, below.y + len(rows) * look.px(_TILE[1] + _CAPTION))
        issued += _sample_words(below, size.x, look)
    else:
        issued += _samples(below, size.x, look)
    imgui.set_cursor_screen_pos(corner)
    imgui.push_item_flag(imgui.ItemFlags_.no_nav, True)
    imgui.invisible_button("welcome", ImVec2(max(size.x, 1), max(size.y, 1)))
    imgui.pop_item_flag()
    if imgui.is_item_hovered():
        imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
    if imgui.is_item_clicked() and not issued:
        issued.append(opening.OpenFiles())
    return issued


def invitation(num_photos: int) -> tuple[str, str]:
    """What can be done here, in a word and in a line, while so many photos wait beside it."""
    if num_photos:
        title = f"{num_photos} photo{'s wait' if num_photos > 1 else ' waits'} on the left"
        return title, "reconstruct the room there, or drop more photos here"
    return "Drop photos of a room here", "two or more, taken a step apart; or a film, a scene, or splats"


def draw_photos(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """The photos side by side as large as they fit, until their scene takes their place."""
    pictures = [look.thumbnails.get(str(photo.path)) for photo in state.scene.photos]
    shown = [picture for picture in pictures if picture is not None]
    if not shown:
        return
    canvas, gap, rounding = imgui.get_window_draw_list(), look.px(_GAP), look.px(6)
    end = ImVec2(corner.x + size.x, corner.y + size.y)
    canvas.add_rect_filled(corner, end, widgets.u32(theme.CANVAS))
    columns = 1 if len(shown) == 1 else 2 if len(shown) <= 4 else 4 if len(shown) <= 12 else 6
    rows = -(-len(shown) // columns)
    wide, tall = (size.x - (columns + 1) * gap) / columns, (size.y - (rows + 1) * gap) / rows
    for place, (picture, aspect) in enumerate(shown):
        left = corner.x + gap + place % columns * (wide + gap)
        top = corner.y + gap + place // columns * (tall + gap)
        width = min(wide, tall * aspect)
        height = width / aspect
        low = ImVec2(left + (wide - width) / 2, top + (tall - height) / 2)
        high = ImVec2(low.x + width, low.y + height)
        canvas.add_image_rounded(picture, low, high, ImVec2(0, 0), ImVec2(1, 1), 0xFFFFFFFF, rounding)


def _line(text: str, at: ImVec2, colour=None, factor: float = 1.0) -> None:
    """Text that ends above `at`, in the middle."""
    imgui.push_font(None, theme.FONT_SIZE * factor)
    extent = imgui.calc_text_size(text)
    place = ImVec2(at.x - extent.x / 2, at.y - extent.y)
    imgui.get_window_draw_list().add_text(place, widgets.u32(colour or theme.MUTED), text)
    imgui.pop_font()


def _buttons(at: ImVec2, look: Look) -> list[do.Command]:
    """Open and paste, their middle at `at`."""
    size, gap = look.vec(150, 0), look.px(8)
    imgui.set_cursor_screen_pos(ImVec2(at.x - size.x - gap / 2, at.y))
    label, tip = f"{fa.ICON_FA_FOLDER_OPEN}  Photos ...", "Several at once, a folder, or a film  (Ctrl+O)"
    issued: list[do.Command] = [*widgets.press(label, opening.OpenFiles(), tip, size, on=True)]
    imgui.same_line(0, gap)
    tip = "A picture, files or a path from the clipboard  (Ctrl+V)"
    return issued + widgets.press(f"{fa.ICON_FA_PASTE}  Paste", opening.Paste(), tip, size)


def _samples(at: ImVec2, room: float, look: Look) -> list[do.Command]:
    """Pairs that come with the program, as many tiles as fit."""
    issued: list[do.Command] = []
    gap, (width, height) = look.px(8), (look.px(side) for side in _TILE)
    pairs = samples.pairs()
    count = min(len(pairs), max(int((room - gap) / (width + gap)), 1))
    _line("or try one of these", ImVec2(at.x, at.y - look.px(8)))
    left = at.x - (count * (width + gap) - gap) / 2
    for place, (label, photos) in enumerate(pairs[:count]):
        corner, size = ImVec2(left + place * (width + gap), at.y), ImVec2(width, height)
        if _tile(f"##sample {label}", sample(place), corner, size, "", look):
            issued.append(try_out(photos))
        _line(label, ImVec2(corner.x + width / 2, corner.y + height + look.px(20)))
    return issued


def _tile(name: str, picture: str, corner: ImVec2, size: ImVec2, icon: str, look: Look) -> bool:
    """A button with a picture on it, or an icon while there is none; whether it was pressed."""
    imgui.set_cursor_screen_pos(corner)
    pressed = imgui.button(name, size)
    canvas, shown = imgui.get_window_draw_list(), look.thumbnails.get(picture)
    end = ImVec2(corner.x + size.x, corner.y + size.y)
    if shown is not None:
        low, high = widgets.middle(shown[1], size.x / size.y)
        canvas.add_image_rounded(shown[0], corner, end, low, high, 0xFFFFFFFF, look.px(6))
    elif icon:
        middle = ImVec2((corner.x + end.x) / 2, (corner.y + end.y) / 2 + look.px(14))
        _line(icon, middle, theme.MUTED, 2.0)
    if imgui.is_item_hovered():
        canvas.add_rect(corner, end, widgets.u32(theme.ACCENT), look.px(6), look.px(2))
    return pressed


def _rows(state: State, size: ImVec2, look: Look) -> list[tuple[Kept, ...]]:
    """Scenes that were open lately, as many as fit, the last one first."""
    projects = state.recovery.projects
    gap, (width, height) = look.px(8), (look.px(side) for side in _TILE)
    columns = max(int((size.x - gap) / (width + gap)), 1)
    room = size.y - look.px(_TITLE + _WORDS + 24)
    most = columns * max(int(room / (height + look.px(_CAPTION))), 1)
    shown = projects[:most]
    return [shown[start : start + columns] for start in range(0, len(shown), columns)]


def _projects(rows: list[tuple[Kept, ...]], at: ImVec2, look: Look) -> list[do.Command]:
    """A tile each, the middle of the first row at `at`."""
    issued: list[do.Command] = []
    gap, (width, height) = look.px(8), (look.px(side) for side in _TILE)
    _line("or continue where you left off", ImVec2(at.x, at.y - look.px(8)))
    for row, projects in enumerate(rows):
        left = at.x - (len(projects) * (width + gap) - gap) / 2
        top = at.y + row * (height + look.px(_CAPTION))
        for place, project in enumerate(projects):
            issued += _project(project, ImVec2(left + place * (width + gap), top), look)
    return issued


def _project(project: Kept, corner: ImVec2, look: Look) -> list[do.Command]:
    """The tile of a scene: what was seen of it, what it is called, when it was open, what it holds."""
    issued: list[do.Command] = []
    size = look.vec(*_TILE)
    pressed = _tile(f"##project {project.scene}", project.picture, corner, size, fa.ICON_FA_CUBE, look)
    held = (project.scene, *(phrase for phrase in project.phrases if phrase.strip()))
    widgets.tooltip("\n".join(held))
    if pressed:
        issued.append(keep.OpenProject(project.scene))
    elif imgui.is_item_focused() and imgui.is_key_pressed(imgui.Key.delete):
        issued.append(keep.ForgetRecent(project.scene))
    side = imgui.get_frame_height()
    below, canvas = corner.y + size.y + look.px(4), imgui.get_window_draw_list()
    name = widgets.shortened(Path(project.scene).name.removesuffix(SCENE_SUFFIX), size.x - side)
    canvas.add_text(ImVec2(corner.x, below), widgets.u32(theme.TEXT), name)
    when = "" if project.when is None else f"{project.when:%d %B, %H:%M}"
    for line, text in enumerate((when, project.project_sentence())):
        place = ImVec2(corner.x, below + (line + 1) * look.px(18))
        canvas.add_text(place, widgets.u32(theme.MUTED), widgets.shortened(text, size.x))
    imgui.set_cursor_screen_pos(ImVec2(corner.x + size.x - side, below - look.px(6)))
    label, tip = f"{fa.ICON_FA_XMARK}##forget {project.scene}", "Remove from this list  (Delete)"
    return issued + widgets.press(label, keep.ForgetRecent(project.scene), tip, quiet=True)


def _sample_words(at: ImVec2, room: float, look: Look) -> list[do.Command]:
    """The pairs that come with the program as words, where other tiles stand; as many as fit."""
    issued: list[do.Command] = []
    said, gap = "or try", look.px(4)
    left, widths = imgui.calc_text_size(said).x + 2 * gap, list[float]()
    for label, _ in samples.pairs():
        width = widgets.button_width(label)
        if left + sum(widths) + width > room:
            break
        widths.append(width)
    left = at.x - (left + sum(widths)) / 2
    imgui.set_cursor_screen_pos(ImVec2(left, at.y))
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, said)
    for label, photos in samples.pairs()[: len(widths)]:
        imgui.same_line(0, gap if label == samples.pairs()[0][0] else 0)
        issued += widgets.press(f"{label}##sample {label}", try_out(photos), quiet=True)
    return issued
