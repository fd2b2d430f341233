"""Where the things to click are, as the program itself drew them.

The calls of ImGui that the panels make are passed on unchanged; the rectangle that each item got is
noted under the item's label. So a test finds a button wherever the layout has put it.
"""

from collections.abc import Callable
from typing import Any

from imgui_bundle import imgui, implot

Rectangle = list[int]  # left, top, right, bottom in pixels of the window
_KINDS = (
    "button", "image_button", "invisible_button", "checkbox", "selectable", "menu_item", "begin_menu",
    "input_text", "input_text_with_hint", "slider_float", "color_edit3", "tree_node_ex", "begin_tab_item",
)  # fmt: skip


class Items:
    """Items of the frame being drawn. Make it before the first frame."""

    def __init__(self) -> None:
        self._found: dict[str, list[Rectangle]] = {}
        self._frame = -1
        for name in _KINDS:
            setattr(imgui, name, self._noting(getattr(imgui, name)))
        drag = implot.drag_line_x

        def drag_line_x(id_: int, x: float, *rest: Any, **named: Any):
            """Its middle, 2 pixels wide."""
            limits = implot.get_plot_limits()
            low, high = (implot.plot_to_pixels(x, y) for y in (limits.y.max, limits.y.min))
            self._note("drag line", low.x - 1, low.y, low.x + 1, high.y)
            corner, size = implot.get_plot_pos(), implot.get_plot_size()
            self._note("plot", corner.x, corner.y, corner.x + size.x, corner.y + size.y)
            return drag(id_, x, *rest, **named)

        implot.drag_line_x = drag_line_x

    def now(self) -> dict[str, list[Rectangle]]:
        """Of the last frame, by label as in the code ("##text"); of equal labels in drawing order."""
        return self._found

    def _noting(self, real: Callable) -> Callable:
        def item(label: str, *rest: Any, **named: Any):
            given = real(label, *rest, **named)
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            self._note(label, low.x, low.y, high.x, high.y)
            return given

        return item

    def _note(self, label: str, *sides: float) -> None:
        frame = imgui.get_frame_count()
        if frame != self._frame:
            self._frame, self._found = frame, {}
        self._found.setdefault(label, []).append([round(side) for side in sides])
