"""The tray: photos with their lenses and notes, the reconstruct button, a job's progress and, at its
end, what each stage cost."""

from collections.abc import Iterable

from imgui_bundle import ImVec2, imgui
from imgui_bundle import icons_fontawesome_6 as fa

from langflash_core.base.records import FoundLens
from langflash_core.base.running import time_left
from langflash_core.geometry.poses import FOV_RANGE
from langflash_core.images.pictures import photo_names
from langflash_core.images.still_names import shown_name
from langflash_core.scene.doubts import join_alike

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...opening import commands as opening
from ...state import State
from .. import commands as show
from .. import lenses
from ..state import Job, Photo, said
from . import rooms, stages

COLUMNS, MORE = 3, 5  # photos side by side; the second where there are over 12
_CANCEL = 104.0  # design pixels
WHOLE = 2  # warnings that leave room in a low window for the phrases' field
NOTABLE_SECONDS = 0.05  # of a finished stage; a shorter one is only a heading of others
HOW_TO_TELL = "click a photo to set it"
WITHOUT_PHOTOS = "open the photos to set it"
_DRAGGED = "photo"  # what a card is called while it is dragged

ONE_PHOTO = "depth is guessed from one photo; add a second one, taken a step aside, to measure it"


def draw(state: State, look: Look) -> list[do.Command]:
    """The photos section."""
    issued: list[do.Command] = []
    widgets.heading("Photos")
    issued += rooms.draw(state, look)
    if state.scene.photos:
        issued += _tray(state, look)
    else:
        _hint(look)
    issued += _row(state, look)
    said = _sentences(state)
    short = not widgets.high(look) and (bool(state.asking.asked) or len(said) > WHOLE)
    for sentence in said:
        _warning(sentence, short)
    stages.draw(state, look)
    return issued


def _row(state: State, look: Look) -> list[do.Command]:
    """The one line of buttons. Of each kind of it they stand in the places of others: the second of a double
    click on those is none on these."""
    scene = state.scene
    if scene.job is not None:
        kind, issued = "job", _progress(scene.job, state.now, look)
    elif scene.photos:
        kind, issued = f"photos {_icons(state)}", _buttons(state, look)
    else:
        opens = f"{fa.ICON_FA_FOLDER_OPEN}  Open ..."
        kind, issued = "none", widgets.press(opens, opening.OpenFiles(), size=ImVec2(_beside(state, look), 0))
        issued = [*issued, *_put_back(state, look)]
    return issued if widgets.takes_clicks(f"row {kind}") else []


def _sentences(state: State) -> list[str]:
    """Each once: what is known of a photo, the scene made of it says."""
    said = [photo.problem for photo in state.scene.photos if photo.problem]
    said += _notes(state)
    said += state.scene.info.warnings if state.scene.info else ()
    if state.scene.info is not None and len(state.scene.info.views) == 1 and state.scene.info.scene.photos:
        said.append(ONE_PHOTO)
    return sentences(said, HOW_TO_TELL if state.scene.photos else WITHOUT_PHOTOS)


def _notes(state: State) -> tuple[str, ...]:
    """What is known of photos, under names that tell them apart, and the scene on show does not say."""
    if not any(photo.notes for photo in state.scene.photos):
        return ()
    told = state.scene.info.scene.record.warnings if state.scene.info else ()
    names = photo_names([photo.path for photo in state.scene.photos])
    notes = (
        note.replace(own, name, 1) if note.startswith(own := shown_name(photo.path.name)) else note
        for name, photo in zip(names, state.scene.photos, strict=True)
        for note in photo.notes
    )
    return join_alike([note for note in notes if note not in told], names)


def sentences(said: Iterable[str], how: str = HOW_TO_TELL) -> list[str]:
    """Warnings as sentences, each once. how: the lens is told."""
    return list(dict.fromkeys(said_here(each, how) for each in said))


def said_here(text: str, how: str = HOW_TO_TELL) -> str:
    """A warning as a sentence; what the core says of its command line in the window's words, also as files
    of before have it."""
    for told in ("set it with --fov", "on the command line, --fov tells it"):
        text = text.replace(told, how)
    return widgets.sentence(text)


def _hint(look: Look) -> None:
    """The place to drop on."""
    width, height = imgui.get_content_region_avail().x, look.px(104)
    corner = imgui.get_cursor_screen_pos()
    canvas = imgui.get_window_draw_list()
    end = ImVec2(corner.x + width, corner.y + height)
    canvas.add_rect_filled(corner, end, widgets.u32(theme.CANVAS), look.px(8))
    canvas.add_rect(corner, end, widgets.u32(theme.LINE), look.px(8), look.px(1.5))
    lines = (
        (fa.ICON_FA_IMAGES, theme.ACCENT),
        ("Drop two or more photos of a room", theme.TEXT),
        ("or a folder, a film, a scene, or a .ply of splats", theme.MUTED),
    )
    step = height / (len(lines) + 1)
    for row, (text, colour) in enumerate(lines, start=1):
        widgets.centred(text, ImVec2(corner.x + width / 2, corner.y + row * step), colour)
    imgui.dummy(ImVec2(width, height))


def _tray(state: State, look: Look) -> list[do.Command]:
    issued: list[do.Command] = []
    spacing = imgui.get_style().item_spacing.x
    columns = COLUMNS if len(state.scene.photos) <= 12 else MORE
    width = (imgui.get_content_region_avail().x - (columns - 1) * spacing) / columns
    size = ImVec2(width, width * 0.75)
    info = state.scene.info if state.scene.aside is None else None  # else it is of other photos
    places = lenses.places(info)
    for index, photo in enumerate(state.scene.photos):
        if index % columns:
            imgui.same_line()
        imgui.push_id(str(photo.path))
        picture = look.thumbnails.get(str(photo.path))
        found = None if picture is None else lenses.found_lens(info, places, photo, picture[1])
        lens = f"Field of view {_fov(photo, found):.0f}°, {_source(photo, found)}"
        removed = _card(look, photo, lens, size, state.scene.job is None)
        if state.scene.job is None:
            issued += _drag(index)
            if removed:
                issued.append(show.RemovePhoto(index))
            elif imgui.is_item_deactivated() and imgui.is_item_hovered():
                way = imgui.get_mouse_drag_delta(0)
                if not (way.x or way.y):
                    imgui.open_popup("lens")
        issued += _details(state, index, photo, found, look)
        imgui.pop_id()
    return issued


def _drag(index: int) -> list[do.Command]:
    """Cards are put in order by dragging one onto the place of another."""
    issued: list[do.Command] = []
    if imgui.begin_drag_drop_source(imgui.DragDropFlags_.source_no_preview_tooltip):
        imgui.set_drag_drop_payload_py_id(_DRAGGED, index)
        imgui.end_drag_drop_source()
    if imgui.begin_drag_drop_target():
        payload = imgui.accept_drag_drop_payload_py_id(_DRAGGED)
        if payload is not None and payload.data_id != index:
            issued.append(show.MovePhoto(payload.data_id, index))
        imgui.end_drag_drop_target()
    return issued


def _card(look: Look, photo: Photo, lens: str, size: ImVec2, open_for_change: bool) -> bool:
    """One thumbnail, cropped to the card; returns whether its cross was pressed. lens: in words."""
    corner = imgui.get_cursor_screen_pos()
    end = ImVec2(corner.x + size.x, corner.y + size.y)
    canvas = imgui.get_window_draw_list()
    imgui.invisible_button("card", size)
    hovered = imgui.is_item_hovered()
    if imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip):
        name = shown_name(photo.path.name)
        imgui.set_tooltip(f"{name}\n{lens}\nClick to set its lens, drag to reorder")
    picture = look.thumbnails.get(str(photo.path))
    canvas.add_rect_filled(corner, end, widgets.u32(theme.RAISED), look.px(6))
    if picture is not None:
        low, high = widgets.middle(picture[1], size.x / size.y)
        canvas.add_image_rounded(picture[0], corner, end, low, high, 0xFFFFFFFF, look.px(6))
    else:
        icon = fa.ICON_FA_TRIANGLE_EXCLAMATION if photo.problem else fa.ICON_FA_IMAGE
        middle = ImVec2((corner.x + end.x) / 2, (corner.y + end.y) / 2)
        widgets.centred(icon, middle, theme.BAD if photo.problem else theme.MUTED)
    if photo.notes:
        _mark(look, ImVec2(corner.x + look.px(4), corner.y + look.px(22)))
    if hovered:
        canvas.add_rect(corner, end, widgets.u32(theme.ACCENT), look.px(6), look.px(1.5))
    return open_for_change and hovered and _cross(look, ImVec2(end.x, corner.y))


def _mark(look: Look, lower_left: ImVec2) -> None:
    """Over a picture of which there is something to say, on a dark ground."""
    text, colour = fa.ICON_FA_TRIANGLE_EXCLAMATION, widgets.u32(theme.DARK.ACCENT)
    canvas, extent = imgui.get_window_draw_list(), imgui.calc_text_size(text)
    factor = 0.82
    size = ImVec2(extent.x * factor + look.px(8), extent.y * factor + look.px(2))
    corner = ImVec2(lower_left.x, lower_left.y - size.y)
    end = ImVec2(corner.x + size.x, lower_left.y)
    canvas.add_rect_filled(corner, end, imgui.IM_COL32(14, 16, 20, 190), look.px(4))
    at = ImVec2(corner.x + look.px(4), corner.y + look.px(1))
    canvas.add_text(imgui.get_font(), imgui.get_font_size() * factor, at, colour, text)


def _cross(look: Look, upper_right: ImVec2) -> bool:
    canvas, side = imgui.get_window_draw_list(), look.px(22)
    place = ImVec2(upper_right.x - side - look.px(3), upper_right.y + look.px(3))
    pointer = imgui.get_mouse_pos()
    over = place.x <= pointer.x <= place.x + side and place.y <= pointer.y <= place.y + side
    ground = theme.DARK.BAD if over else theme.DARK.CANVAS
    canvas.add_rect_filled(place, ImVec2(place.x + side, place.y + side), widgets.u32(ground), look.px(11))
    widgets.centred(fa.ICON_FA_XMARK, ImVec2(place.x + side / 2, place.y + side / 2), theme.DARK.TEXT)
    return over and imgui.is_mouse_clicked(0)


def _fov(photo: Photo, found: FoundLens | None) -> float:
    """Degrees in force: the person's own come before what the photos told, and that before their files."""
    told = photo.recorded or lenses.ASSUMED_FOV if found is None else found.fov
    return photo.fov or told


def _source(photo: Photo, found: FoundLens | None) -> str:
    """Whence these are."""
    if photo.fov is not None:
        return "your own"
    if found is not None:
        return f"found from the photos, ± {found.error:.1f}"
    return "from the file" if photo.recorded else "assumed: the file does not say"


def _details(state: State, index: int, photo: Photo, found: FoundLens | None, look: Look) -> list[do.Command]:
    """A card's own panel: its lens, its place, what the triage has to say."""
    issued: list[do.Command] = []
    imgui.set_next_window_size(ImVec2(look.px(330), 0))
    if not imgui.begin_popup("lens"):
        return issued
    widgets.heading(shown_name(photo.path.name))
    widgets.muted(f"Field of view of the longer side, {_source(photo, found)}")
    width, now = imgui.get_content_region_avail().x, _fov(photo, found)
    changed, fov = widgets.slider("##fov", now, FOV_RANGE, f"{now:.0f}°", "", width)
    if changed:
        issued.append(show.SetPhotoFov(index, fov))
    untold = "Use the recorded one" if photo.recorded else "Use the default"
    label = f"{fa.ICON_FA_ROTATE_LEFT}  {untold if found is None else 'Use the one found'}"
    issued += widgets.press(label, show.SetPhotoFov(index, None), able=photo.fov is not None)
    for label, place, tip in (
        (fa.ICON_FA_ARROW_LEFT, index - 1, "Move earlier; the first photo sets the scene's axes"),
        (fa.ICON_FA_ARROW_RIGHT, index + 1, "Move later"),
    ):
        imgui.same_line()
        there = 0 <= place < len(state.scene.photos)
        issued += widgets.press(label, show.MovePhoto(index, place), tip, able=there)
    imgui.same_line()
    if removed := widgets.press(fa.ICON_FA_TRASH, show.RemovePhoto(index), "Remove from the tray"):
        issued += removed
        imgui.close_current_popup()
    for note in photo.notes:
        _warning(said_here(note))
    imgui.end_popup()
    return issued


def _icons(state: State) -> tuple[bool, ...]:
    """Which buttons of an icon alone there are: for a pair, to put photos back, to clear the tray."""
    count = len(state.scene.photos)
    return count >= 3, state.scene.num_taken_out > 0, count > 0


def _side(look: Look) -> float:
    """The width of one of them."""
    return imgui.get_frame_height() + look.px(6)


def _beside(state: State, look: Look) -> float:
    """The width that they leave to the first button."""
    each = _side(look) + imgui.get_style().item_spacing.x
    return imgui.get_content_region_avail().x - sum(_icons(state)) * each


def _put_back(state: State, look: Look) -> list[do.Command]:
    """A button for what was taken out of the tray last."""
    count = state.scene.num_taken_out
    if not count:
        return []
    imgui.same_line()
    tip = f"Put {count} photos back" if count > 1 else "Put the photo back"
    return widgets.press(f"{fa.ICON_FA_ROTATE_LEFT}##back", show.PutPhotosBack(), tip, ImVec2(_side(look), 0))


def _buttons(state: State, look: Look) -> list[do.Command]:
    side, goes_on = ImVec2(_side(look), 0), state.scene.goes_on
    imgui.begin_disabled(state.scene.choosing)
    label = f"{fa.ICON_FA_PLAY}  Resume" if goes_on else f"{fa.ICON_FA_CUBES}  Reconstruct"
    begin, tip = show.Instead((show.Reconstruct(),)), "Continue from the saved progress" if goes_on else ""
    width = ImVec2(_beside(state, look), 0)
    issued: list[do.Command] = [*widgets.press(f"{label}###reconstruct", begin, tip, width, on=True)]
    if _icons(state)[0]:
        imgui.same_line()
        icon = fa.ICON_FA_HOURGLASS_HALF if state.scene.choosing else fa.ICON_FA_FILTER
        tip = "Keep only the two photos that make the best scene together"
        issued += widgets.press(f"{icon}##pair", show.ChoosePair(), tip, side)
    issued += _put_back(state, look)
    imgui.same_line()
    tip = "Clear the tray; the scene stays"
    issued += widgets.press(f"{fa.ICON_FA_TRASH}##clear", show.ClearPhotos(), tip, side)
    imgui.end_disabled()
    return issued


def _progress(job: Job, now: float, look: Look) -> list[do.Command]:
    """Cancel, pause and what is left, a bar below, and below that the stage under way: nothing moves by a
    stage. The finished ones with their seconds on hover."""
    issued: list[do.Command] = []
    imgui.begin_disabled(job.cancelling)
    stop, pause = f"{fa.ICON_FA_STOP}  Cancel", f"{fa.ICON_FA_PAUSE}##pause"
    issued += widgets.press(stop, show.CancelJob(), "Stop  (Esc)", look.vec(_CANCEL, 0))
    imgui.same_line()
    if job.pausable:
        tip = "Pause: progress is kept, even if you quit"
        issued += widgets.press(pause, show.PauseJob(), tip, ImVec2(_side(look), 0))
        imgui.same_line()
    imgui.end_disabled()
    imgui.align_text_to_frame_padding()
    with widgets.colours(text=theme.MUTED):
        imgui.text("")
        widgets.at_right_edge(_seconds(job, now))
    corner, width = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail().x
    _bar(job.fraction, ImVec2(corner.x, corner.y - look.px(4)), width, look)
    ending = "pausing" if job.pausing else "stopping"
    imgui.text(widgets.shortened(ending if job.cancelling else said(job.stage), width))
    if imgui.is_item_hovered():
        told = [f"{said(stage)}  {cost:.1f} s" for stage, cost in job.done if cost >= NOTABLE_SECONDS]
        imgui.set_tooltip("\n".join((job.title, *told)))
    return issued


def _seconds(job: Job, now: float) -> str:
    """What is left of the job, where that can be told; else seconds of the stage so far."""
    return time_left(job.age(now), job.fraction) or f"{now - job.started:.1f} s"


def _bar(fraction: float, corner: ImVec2, width: float, look: Look) -> None:
    """A fraction as a line from `corner` down, in the gap before the next item."""
    canvas, height = imgui.get_window_draw_list(), look.px(4)
    for share, colour in ((1.0, theme.LINE), (fraction, theme.ACCENT)):
        end = ImVec2(corner.x + share * width, corner.y + height)
        canvas.add_rect_filled(corner, end, widgets.u32(colour), look.px(2))


def _warning(sentence: str, short: bool = False) -> None:
    """short: as much of it as a line holds, and all on hover."""
    with widgets.colours(text=theme.ACCENT):
        imgui.text(fa.ICON_FA_TRIANGLE_EXCLAMATION)
    imgui.same_line()
    line = widgets.shortened(sentence, imgui.get_content_region_avail().x) if short else sentence
    widgets.muted(line)
    widgets.tooltip(sentence if line != sentence else "")
