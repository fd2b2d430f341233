"""The empty window: a picture that is a button, samples to try, recent scenes; and the photos at work on."""

from pathlib import Path

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...scene import commands as show
from ...scene import samples
from ...scene.state import RECONSTRUCTING, said
from ...state import State
from .. import commands as opening
from ..state import sample

_TILE = (150.0, 100.0)  # design pixels
_RECENT = 3
_GAP = 12.0


def working(state: State) -> bool:
    """Whether the photos at work on are to be seen instead of a scene that is not theirs."""
    job = state.scene.job
    ours = job is not None and job.title == RECONSTRUCTING and bool(state.scene.photos)
    return ours and (state.scene.info is None or state.scene.aside is not None)


def draw(state: State, look: Look, corner: ImVec2, size: ImVec2) -> list[do.Command]:
    """On the canvas at `corner` while there is no scene."""
    if state.scene.job is not None:
        doing = f"{state.scene.job.title}: {said(state.scene.job.stage)}"
        _line(doing, ImVec2(corner.x + size.x / 2, corner.y + size.y / 2))
        return []
    top = corner.y + max(size.y / 2 - look.px(170), look.px(12))
    middle = corner.x + size.x / 2
    _line(fa.ICON_FA_CUBES, ImVec2(middle, top + look.px(40)), theme.LINE, 3.0)
    _line("Drop photos of a room here", ImVec2(middle, top + look.px(72)), theme.TEXT, 1.25)
    hint = "two or more, taken a step apart; or a film, a scene, or splats"
    _line(hint, ImVec2(middle, top + look.px(98)))
    issued = _buttons(ImVec2(middle, top + look.px(112)), look)
    issued += _samples(ImVec2(middle, top + look.px(176)), size.x, look)
    issued += _recent(state, ImVec2(middle, top + look.px(310)), look)
    imgui.set_cursor_screen_pos(corner)
    imgui.invisible_button("welcome", ImVec2(max(size.x, 1), max(size.y, 1)))
    if imgui.is_item_hovered():
        imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
    if imgui.is_item_clicked() and not issued:
        issued.append(opening.OpenFiles())
    return issued


def draw_photos(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """The photos side by side as large as they fit, until their scene takes their place."""
    pictures = [look.thumbnails.get(str(photo.path)) for photo in state.scene.photos]
    shown = [picture for picture in pictures if picture is not None]
    if not shown:
        return
    canvas, gap = imgui.get_window_draw_list(), look.px(_GAP)
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
        canvas.add_image_rounded(
            picture, low, ImVec2(low.x + width, low.y + height), ImVec2(0, 0), ImVec2(1, 1), 0xFFFFFFFF,
            look.px(6),
        )  # fmt: skip


def _line(text: str, at: ImVec2, colour=None, factor: float = 1.0) -> None:
    """Text that ends above `at`, in the middle."""
    imgui.push_font(None, theme.FONT_SIZE * factor)
    extent = imgui.calc_text_size(text)
    place = ImVec2(at.x - extent.x / 2, at.y - extent.y)
    imgui.get_window_draw_list().add_text(place, widgets.u32(colour or theme.MUTED), text)
    imgui.pop_font()


def _buttons(at: ImVec2, look: Look) -> list[do.Command]:
    """Open and paste, their middle at `at`."""
    issued: list[do.Command] = []
    width, gap = look.px(150), look.px(8)
    imgui.set_cursor_screen_pos(ImVec2(at.x - width - gap / 2, at.y))
    if widgets.primary_button(f"{fa.ICON_FA_FOLDER_OPEN}  Photos ...", ImVec2(width, 0)):
        issued.append(opening.OpenFiles())
    widgets.tooltip("Several at once, a folder, or a film  (Ctrl+O)")
    imgui.same_line(0, gap)
    if imgui.button(f"{fa.ICON_FA_PASTE}  Paste", ImVec2(width, 0)):
        issued.append(opening.Paste())
    widgets.tooltip("A picture, files or a path from the clipboard  (Ctrl+V)")
    return issued


def _samples(at: ImVec2, room: float, look: Look) -> list[do.Command]:
    """Pairs that come with the program, as many tiles as fit."""
    issued: list[do.Command] = []
    gap, (width, height) = look.px(8), (look.px(side) for side in _TILE)
    pairs = samples.pairs()
    count = min(len(pairs), max(int((room - gap) / (width + gap)), 1))
    _line("or try one of these", ImVec2(at.x, at.y - look.px(8)))
    left = at.x - (count * (width + gap) - gap) / 2
    for place, (label, photos) in enumerate(pairs[:count]):
        corner = ImVec2(left + place * (width + gap), at.y)
        imgui.set_cursor_screen_pos(corner)
        pressed = imgui.button(f"##sample {label}", ImVec2(width, height))
        canvas, picture = imgui.get_window_draw_list(), look.thumbnails.get(sample(place))
        end = ImVec2(corner.x + width, corner.y + height)
        if picture is not None:
            low, high = widgets.middle(picture[1], width / height)
            canvas.add_image_rounded(picture[0], corner, end, low, high, 0xFFFFFFFF, look.px(6))
        if imgui.is_item_hovered() or imgui.is_item_focused():
            canvas.add_rect(corner, end, widgets.u32(theme.ACCENT), look.px(6), look.px(2))
        _line(label, ImVec2((corner.x + end.x) / 2, end.y + look.px(20)))
        if pressed:
            issued.append(show.Instead((show.SetPhotosAside(), show.AddPhotos(photos), show.Reconstruct())))
    return issued


def _recent(state: State, at: ImVec2, look: Look) -> list[do.Command]:
    """The last scenes, a button each."""
    issued: list[do.Command] = []
    paths = state.preferences.recent[:_RECENT]
    names = [f"{fa.ICON_FA_CUBE}  {widgets.shortened(Path(path).name, look.px(180))}" for path in paths]
    padding = 2 * imgui.get_style().frame_padding.x
    widths = [imgui.calc_text_size(name).x + padding for name in names]
    left = at.x - (sum(widths) + look.px(8) * max(len(widths) - 1, 0)) / 2
    for name, path, width in zip(names, paths, widths, strict=True):
        imgui.set_cursor_screen_pos(ImVec2(left, at.y))
        if widgets.quiet_button(f"{name}##{path}", path):
            issued.append(show.OpenPaths((path,)))
        left += width + look.px(8)
    return issued
