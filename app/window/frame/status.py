"""The bottom line: how fast, how much, on what."""

from collections.abc import Sequence
from itertools import accumulate

from imgui_bundle import imgui

from langflash_core.base.memory import told_bytes

from ..kit import theme, widgets
from ..kit.look import Look
from ..scene.near import FADING, degrees_from_photos, flown_past
from ..scene.state import said as in_words
from ..state import State

_MUCH = 10**9  # bytes, from which on somebody may want to know; what is held now would change frame by frame


def draw(state: State, look: Look) -> None:
    """As many figures as fit, the rest on hover; issues nothing."""
    texts, space = figures(state), look.px(26)
    width = imgui.get_content_region_avail().x
    shown = fitting([imgui.calc_text_size(text).x for text in texts], space, width)
    with widgets.colours(text=theme.MUTED):
        for index, text in enumerate(texts[:shown]):
            if index:
                imgui.same_line(0, space)
            imgui.text(text)
    if shown < len(texts) and imgui.is_window_hovered():
        imgui.set_tooltip("\n".join(texts[shown:]))


def fitting(widths: Sequence[float], space: float, room: float) -> int:
    """How many of the first fit side by side into `room`."""
    ends = list(accumulate(width + space for width in widths))
    return sum(end - space <= room for end in ends)


def figures(state: State) -> list[str]:
    """What there is to say, the most wanted first."""
    stats = state.stats
    said = [f"frame {1000 * stats.frame_seconds:.1f} ms"]
    if state.scene.job is not None:  # its bar is at the panel's top, which may be scrolled away or covered
        said.insert(0, f"{state.scene.job.title}: {in_words(state.scene.job.stage)}")
    aside = degrees_from_photos(state)
    if flown_past(state):
        said.insert(0, "the scene is behind you: press H to go back")
    elif state.scene.hold is not None and state.scene.hold.refused:
        said.insert(0, "no photo saw more on this side: drag on to go there all the same")
    elif aside > FADING:
        said.append(f"{aside:.0f}° away from the nearest photo: expect holes")
    if state.scene.info is not None:
        width, height = stats.picture_size
        marks = state.editing.marks
        there = marks.there if marks else (state.scene.info.num_gaussians, state.scene.info.num_atoms)
        if stats.failing:
            said.append("refining failed (F2 says why); trying again")
        elif stats.settling:
            said.append("refining ...")
        said += [
            f"picture {1000 * stats.picture_seconds:.0f} ms at {width} x {height}",
            _count(there[0], state.editing.num_deleted),
            f"{there[1]} groups",
        ]
        if stats.memory >= _MUCH:
            said.append(f"up to {told_bytes(stats.memory)} of memory so far")
        hover = state.editing.hover
        if hover is not None and hover.point is not None:
            x, y, z = hover.point
            said.append(f"x {x:.3f}  y {y:.3f}  z {z:.3f}  depth {hover.depth:.3f}")
    said.append(stats.renderer)
    return said


def _count(num_gaussians: int, num_deleted: int) -> str:
    """How many Gaussians there are; after a deletion how many are left."""
    left = f"{num_gaussians - num_deleted:,} of " if num_deleted else ""
    return f"{left}{num_gaussians:,} Gaussians"
