"""The bottom line: how fast, how much, on what."""

from imgui_bundle import imgui

from app.window import theme
from app.window.panels import widgets
from app.window.panels.look import Look
from app.window.state import State


def draw(state: State, look: Look) -> None:
    """The status bar; issues nothing."""
    with widgets.colours(text=theme.MUTED):
        for index, text in enumerate(_figures(state)):
            if index:
                imgui.same_line(0, look.px(26))
            imgui.text(text)


def _figures(state: State) -> list[str]:
    stats = state.stats
    figures = [f"frame {1000 * stats.frame_seconds:.1f} ms"]
    if state.info is not None:
        width, height = stats.picture_size
        figures += [
            f"picture {1000 * stats.picture_seconds:.0f} ms at {width} x {height}",
            f"{state.info.num_gaussians:,} Gaussians",
            f"{state.info.num_atoms} atoms",
        ]
        hover = state.editing.hover
        if hover is not None and hover.point is not None:
            x, y, z = hover.point
            figures.append(f"x {x:.3f}  y {y:.3f}  z {z:.3f}  depth {hover.depth:.3f}")
    figures.append(stats.renderer)
    if stats.passes:
        figures.append("passes: " + ", ".join(f"{kind} {count}" for kind, count in stats.passes))
    return figures
