"""The photos by place: the map opens, a click flies to a photo, what was left out is said."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch
from imgui_bundle import imgui

from app.window.frame import layout
from app.window.kit import theme
from app.window.opening.commands import films_of
from app.window.opening.state import Film
from app.window.scene import camera
from app.window.scene.panels import places
from app.window.scene.state import Photo
from app.window.scene.work import DrawAbove, describe_scene
from app.window.state import State
from langflash_core.images.strip import Strip
from tests.app.window import headless
from tests.app.window.scenes import after, room, shown_scene

LEFT_OUT = {
    "shares": [0.0, 0.12, 0.0, 0.0],
    "unplaced": ["IMG_7.jpg"],
    "films": [{"film": "walk.mp4", "frames": 480, "why": {"were blurred": 12}}],
}


def many(left_out: dict | None = None, count: int = 4) -> State:
    scene = room(torch.eye(3))
    viewmats = torch.eye(4).repeat(count, 1, 1)
    viewmats[:, 0, 3] = -0.2 * torch.arange(count)
    scene = replace(
        scene, viewmats=viewmats, Ks=scene.Ks[:1].repeat(count, 1, 1), photos=scene.photos[:1] * count
    )
    scene = scene.with_record(left_out=left_out or {}, photos=tuple(f"IMG_{v}.jpg" for v in range(count)))
    return shown_scene().with_scene(info=describe_scene(scene, 2, "walk"))


def test_what_was_left_out_is_said() -> None:
    info = many(LEFT_OUT).scene.info
    assert info is not None
    assert places.left_out(info) == [
        "Could not be placed, too little overlap with other photos: IMG_7.jpg.",
        "Parts of 1 photo (ringed) were left out: other photos show something else there.",
        "Of 480 frames of walk.mp4, 12 were blurred.",
    ]
    odd = many({"shares": [0.5], "unplaced": "x", "films": [3, {"film": 1}]}).scene.info
    assert odd is not None and places.left_out(odd) == []


@pytest.mark.parametrize(
    ("count", "left_out", "there"), [(2, {}, False), (2, {"unplaced": ["a"]}, True), (3, {}, True)]
)
def test_it_is_offered_where_there_is_something_to_show(count: int, left_out: dict, there: bool) -> None:
    info = many(left_out, count).scene.info
    assert info is not None and places.offered(info) == there


@pytest.mark.parametrize("size", [(1280, 800), (800, 500)])
def test_a_click_on_the_map_flies_to_the_photo(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    state = many(LEFT_OUT)
    info = state.scene.info
    assert info is not None and info.above is not None
    issued = []
    items: dict[str, tuple[float, float, float, float]] = {}

    def noting(real):
        def item(label: str, *rest):
            given, low, high = real(label, *rest), imgui.get_item_rect_min(), imgui.get_item_rect_max()
            items[label] = (low.x, low.y, high.x, high.y)
            return given

        return item

    for name in ("button", "invisible_button"):
        monkeypatch.setattr(imgui, name, noting(getattr(imgui, name)))
    with headless.context(size):
        theme.set_up(1.0)
        io = imgui.get_io()

        def drawn(look):
            return layout.draw_all(state, look)[0]

        def press(x: float, y: float) -> None:
            for down in (None, True, False, None):
                io.add_mouse_pos_event(x, y)
                if down is not None:
                    io.add_mouse_button_event(0, down)
                headless.frames(lambda look: issued.extend(drawn(look)), headless.look(), 2)

        headless.frames(drawn, headless.look())
        (button,) = [box for label, box in items.items() if label.endswith("###places")]
        press((button[0] + button[2]) / 2, (button[1] + button[3]) / 2)
        left, top, right, bottom = items["map"]
        assert left >= 0 and right <= size[0] and top >= 0 and bottom <= size[1]
        x, y = info.above.eyes[3]
        press(left + x * (right - left), top + y * (bottom - top))
    assert [command for command in issued if isinstance(command, camera.JumpTo)] == [camera.JumpTo(3)]
    assert after(state, camera.JumpTo(3)).scene.view == 3


def test_the_map_is_drawn_once_for_a_scene() -> None:
    info = many().scene.info
    assert info is not None and info.above is not None
    (shown,) = DrawAbove(2, info.scene, info.above).run(lambda: False)
    assert vars(shown)["key"] == "from above"


def test_the_record_of_a_film_is_that_of_its_frames_in_the_tray() -> None:
    strip = Strip("walk.mp4", Path("/kept/strip"), 20.0, (), dark=480)
    film = Film(Path("/walk.mp4"), strip, (), (("blurred", 12), ("dark", 0)))
    state = State().with_opening(film=film)
    assert films_of(state) == ()
    photos = (Photo(Path("/kept/strip/walk.mp4 @ 1.00 s.jpg")),)
    assert films_of(state.with_scene(photos=photos)) == tuple(LEFT_OUT["films"])
    assert films_of(state.with_scene(photos=(Photo(Path("/other/a.jpg")),))) == ()
