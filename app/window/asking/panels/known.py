"""What can be found here: the things this scene knows, as chips to click, and how well the model knows."""

from imgui_bundle import imgui

from ... import commands as do
from ...kit import theme, widgets
from ...kit.look import Look
from ...state import State
from .. import commands as ask

MOST = 10
LEAST_SHARE = 0.004  # of what is left of the scene; smaller groups are seldom what they are called
KNOWS = "Names 68 % of a real room right among 37 kinds of things; understands English."
"""assets/weights/mini_card.md, "Real photos": atoms drawn, by area."""


def draw(state: State, look: Look) -> list[do.Command]:
    """A row or two of chips; nothing without a scene that has names."""
    found = things(state)
    if not found or state.info is None:
        return []
    issued: list[do.Command] = []
    asked = {prompt.text.strip().lower() for prompt in state.prompts}
    imgui.push_style_var(imgui.StyleVar_.frame_padding, look.vec(8, 3))
    imgui.align_text_to_frame_padding()
    imgui.text_colored(theme.MUTED, "Here are")
    right = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
    for name in found:
        width = imgui.calc_text_size(name).x + look.px(16)
        imgui.same_line(0, look.px(6))
        if imgui.get_cursor_screen_pos().x + width > right:
            imgui.new_line()
        imgui.begin_disabled(name in asked)
        if imgui.button(f"{name}##known"):
            issued.append(ask.AskAgain(name))
        imgui.end_disabled()
    imgui.pop_style_var()
    if state.info.scene.record.preset == "mini":
        widgets.muted(KNOWS)
    return issued


def things(state: State) -> tuple[str, ...]:
    """Names of the groups that speak, the largest first, each once."""
    return tuple(told(state))


def told(state: State) -> dict[str, int]:
    """The same with the largest group of each name."""
    insight, history = state.asking.insight, state.editing.history
    if insight is None or history is None:
        return {}
    atoms = history.marks.atoms
    speak = [k for k, atom in enumerate(atoms) if atom.on and k < len(insight.shares)]
    speak = [k for k in speak if insight.shares[k] >= LEAST_SHARE and (atoms[k].name or _named(state, k))]
    found: dict[str, int] = {}
    for k in sorted(speak, key=lambda k: -insight.shares[k]):
        found.setdefault(state.editing.atom_name(k).lower(), k)
    return dict(list(found.items())[:MOST])


def _named(state: State, k: int) -> bool:
    return k < len(state.editing.names) and bool(state.editing.names[k])
