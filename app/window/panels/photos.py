"""The tray: photos, the reconstruct button, a job's progress, and what the triage has to say."""

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from app.window import commands as do
from app.window import theme
from app.window.panels import widgets
from app.window.panels.look import Look
from app.window.state import Job, State

COLUMNS = 3
NOTABLE_SECONDS = 0.05  # of a finished stage; a shorter one is only a heading of others


def draw(state: State, look: Look) -> list[do.Command]:
    """The photos section."""
    issued: list[do.Command] = []
    widgets.heading("Photos")
    if state.photos:
        issued += _tray(state, look)
    else:
        _hint(look)
    if state.job is not None:
        issued += _progress(state.job, state.now, look)
    elif state.photos:
        issued += _buttons(state, look)
    for sentence in _sentences(state):
        _warning(sentence)
    return issued


def _sentences(state: State) -> list[str]:
    problems = [photo.problem for photo in state.photos if photo.problem]
    return problems + (list(state.info.warnings) if state.info else [])


def _hint(look: Look) -> None:
    """The place to drop on."""
    width, height = imgui.get_content_region_avail().x, look.px(104)
    corner = imgui.get_cursor_screen_pos()
    canvas = imgui.get_window_draw_list()
    end = ImVec2(corner.x + width, corner.y + height)
    canvas.add_rect_filled(corner, end, widgets.u32(theme.CANVAS), look.px(8))
    canvas.add_rect(corner, end, widgets.u32(theme.LINE), look.px(8), look.px(1.5))
    lines = ((fa.ICON_FA_IMAGES, theme.ACCENT), ("Drop two or more photos of a room", theme.TEXT))
    lines = (*lines, ("or a folder, a scene, or a .ply of splats", theme.MUTED))
    step = height / (len(lines) + 1)
    for row, (text, colour) in enumerate(lines, start=1):
        size = imgui.calc_text_size(text)
        at = ImVec2(corner.x + (width - size.x) / 2, corner.y + row * step - size.y / 2)
        canvas.add_text(at, widgets.u32(colour), text)
    imgui.dummy(ImVec2(width, height))


def _tray(state: State, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    spacing = imgui.get_style().item_spacing.x
    width = (imgui.get_content_region_avail().x - (COLUMNS - 1) * spacing) / COLUMNS
    size = ImVec2(width, width * 0.75)
    for index, photo in enumerate(state.photos):
        if index % COLUMNS:
            imgui.same_line()
        imgui.push_id(index)
        if _card(look, str(photo.path), photo.path.name, size, bool(photo.problem)) and state.job is None:
            issued.append(do.RemovePhoto(index))
        imgui.pop_id()
    return issued


def _card(look: Look, key: str, name: str, size: ImVec2, broken: bool) -> bool:
    """One thumbnail, cropped to the card; returns whether its cross was pressed."""
    corner = imgui.get_cursor_screen_pos()
    end = ImVec2(corner.x + size.x, corner.y + size.y)
    canvas = imgui.get_window_draw_list()
    imgui.invisible_button("card", size)
    hovered = imgui.is_item_hovered()
    if imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip):
        imgui.set_tooltip(name)
    picture = look.thumbnails.get(key)
    canvas.add_rect_filled(corner, end, widgets.u32(theme.RAISED), look.px(6))
    if picture is not None:
        low, high = _crop(picture[1], size.x / size.y)
        canvas.add_image_rounded(picture[0], corner, end, low, high, 0xFFFFFFFF, look.px(6))
    else:
        icon = fa.ICON_FA_TRIANGLE_EXCLAMATION if broken else fa.ICON_FA_IMAGE
        extent = imgui.calc_text_size(icon)
        middle = ImVec2((corner.x + end.x - extent.x) / 2, (corner.y + end.y - extent.y) / 2)
        canvas.add_text(middle, widgets.u32(theme.BAD if broken else theme.MUTED), icon)
    if not hovered:
        return False
    side = look.px(22)
    place = ImVec2(end.x - side - look.px(3), corner.y + look.px(3))
    pointer = imgui.get_mouse_pos()
    over = place.x <= pointer.x <= place.x + side and place.y <= pointer.y <= place.y + side
    ground = theme.BAD if over else theme.CANVAS
    canvas.add_rect_filled(place, ImVec2(place.x + side, place.y + side), widgets.u32(ground), look.px(11))
    extent = imgui.calc_text_size(fa.ICON_FA_XMARK)
    at = ImVec2(place.x + (side - extent.x) / 2, place.y + (side - extent.y) / 2)
    canvas.add_text(at, widgets.u32(theme.TEXT), fa.ICON_FA_XMARK)
    return over and imgui.is_mouse_clicked(0)


def _crop(aspect: float, target: float) -> tuple[ImVec2, ImVec2]:
    """Texture corners that fill a card of aspect `target` with the middle of a picture."""
    if aspect > target:
        margin = (1 - target / aspect) / 2
        return ImVec2(margin, 0), ImVec2(1 - margin, 1)
    margin = (1 - aspect / target) / 2
    return ImVec2(0, margin), ImVec2(1, 1 - margin)


def _buttons(state: State, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    clear = f"{fa.ICON_FA_TRASH}##clear"
    side = imgui.get_frame_height()
    width = imgui.get_content_region_avail().x - side - look.px(20)
    if widgets.primary_button(f"{fa.ICON_FA_CUBES}  Reconstruct", ImVec2(width, 0)):
        issued.append(do.Reconstruct())
    imgui.same_line()
    if imgui.button(clear, ImVec2(imgui.get_content_region_avail().x, 0)):
        issued.append(do.ClearPhotos())
    widgets.tooltip("Clear the tray; the scene stays")
    return issued


def _progress(job: Job, now: float, look: Look) -> list[do.Command]:
    """The stage under way with its bar, the finished ones with their seconds, and cancel."""
    imgui.text(job.title)
    for stage, seconds in job.done:
        if seconds < NOTABLE_SECONDS:
            continue
        with widgets.colours(text=theme.MUTED):
            imgui.text(f"{fa.ICON_FA_CHECK}  {stage}")
            figure = f"{seconds:.1f} s"
            edge = imgui.get_window_width() - imgui.get_style().window_padding.x
            imgui.same_line(edge - imgui.calc_text_size(figure).x)
            imgui.text(figure)
    stage = "stopping after this stage" if job.cancelling else job.stage
    imgui.text(f"{stage}  {now - job.started:.1f} s")
    imgui.progress_bar(job.fraction, ImVec2(-1, look.px(8)), "")
    imgui.begin_disabled(job.cancelling)
    pressed = imgui.button(f"{fa.ICON_FA_STOP}  Cancel", ImVec2(-1, 0))
    imgui.end_disabled()
    return [do.CancelJob()] if pressed else []


def _warning(sentence: str) -> None:
    with widgets.colours(text=theme.ACCENT):
        imgui.text(fa.ICON_FA_TRIANGLE_EXCLAMATION)
    imgui.same_line()
    widgets.muted(sentence)
