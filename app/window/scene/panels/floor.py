"""On the picture: a grid on the floor that the scene stands on, a metre a square where lengths are known or
guessed."""

import math

import numpy as np
from imgui_bundle import ImVec2, imgui
from jaxtyping import Float

from langflash_core.geometry import poses

from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State

MOST = 40  # squares along a side
_PIECES = 32  # of a line: what is behind the camera is left out piece by piece
_FAINT = 0.28


def draw(state: State, look: Look, corner: ImVec2, size: ImVec2) -> None:
    """The lines, over the picture in the present window."""
    if not state.preferences.floor_grid:
        return
    canvas = imgui.get_window_draw_list()
    accent = theme.DARK.ACCENT
    colour = widgets.u32(widgets.rgba((accent.x, accent.y, accent.z), _FAINT))
    canvas.push_clip_rect(corner, ImVec2(corner.x + size.x, corner.y + size.y), True)
    for line in lines(state):
        seen = poses.visible(line, state.scene.pose, (size.x, size.y))
        for (ax, ay), (bx, by) in seen:
            start, end = ImVec2(corner.x + ax, corner.y + ay), ImVec2(corner.x + bx, corner.y + by)
            canvas.add_line(start, end, colour, look.px(1.2))
    canvas.pop_clip_rect()


def lines(state: State) -> list[Float[np.ndarray, "n 3"]]:
    """Each line of the grid as points along it, in the scene's axes; none where nobody knows the floor."""
    info, world = state.scene.info, state.world
    if info is None or world is None or info.extent is None:
        return []
    low, high = np.array(info.extent)
    corners = np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
    stands = ((corners - world.origin) @ state.turn.T)[:, [0, 2]]
    side = square(state, float((stands.max(0) - stands.min(0)).max()))
    first, last = np.floor(stands.min(0) / side), np.ceil(stands.max(0) / side)
    found = []
    for axis in (0, 1):
        along = np.linspace(first[1 - axis], last[1 - axis], _PIECES + 1) * side
        for place in np.arange(first[axis], last[axis] + 1) * side:
            points = np.zeros((len(along), 3))
            points[:, 2 * axis], points[:, 2 - 2 * axis] = place, along
            found.append(points @ state.turn + world.origin)
    return found


def square(state: State, across: float) -> float:
    """Side of a square, scene units: a metre, or ten of a large scene; without a scale about a tenth."""
    metres = state.metric or (state.guess.metres if state.guess else None)
    side = 1 / metres if metres else 10 ** math.floor(math.log10(max(across, 1e-6))) / 2
    while across / side > MOST:
        side *= 10
    return side
