"""The things that a scene knows, by the names of its groups."""

from ..state import State

MOST = 10
LEAST_SHARE = 0.004  # of what is left of the scene; smaller groups are seldom what they are called


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
