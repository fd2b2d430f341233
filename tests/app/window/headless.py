"""Panels on a real ImGui context without a window or a picture."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace

from imgui_bundle import ImVec2, imgui

from app.window.kit.boxes import Box
from app.window.kit.look import Look


def look(scale: float = 1.0) -> Look:
    """Without a picture and thumbnails."""
    return Look(scale, None, SimpleNamespace(get=lambda name: None))  # pyright: ignore[reportArgumentType]


@contextmanager
def context(size: tuple[int, int]) -> Iterator[None]:
    """An ImGui context for a screen of `size` pixels."""
    made = imgui.create_context()
    io = imgui.get_io()
    io.set_ini_filename("")
    io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
    io.display_size = ImVec2(*size)
    try:
        yield
    finally:
        imgui.destroy_context(made)


def frames(draw: Callable[[Look], object], look: Look, count: int = 4) -> None:
    """Draw some frames; a window finds its size in two."""
    for _ in range(count):
        imgui.new_frame()
        draw(look)
        imgui.end_frame()


def box(name: str) -> Box:
    """Where a window of the last frame is."""
    window = imgui.internal.find_window_by_name(name)
    assert window is not None and (window.was_active or window.active), name
    return (window.pos.x, window.pos.y, window.pos.x + window.size.x, window.pos.y + window.size.y)
