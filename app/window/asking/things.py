"""The things that a scene knows, by the names of its groups and of its inventory."""

from ..state import State

MOST = 10
LEAST_SHARE = 0.004  # of what is left of the scene; smaller groups are seldom what they are called


def things(state: State) -> tuple[str, ...]:
    """Names that are found when asked, each once: of the groups that speak, the largest first, then of what
    the inventory lists."""
    return tuple(dict.fromkeys((*told(state), *state.listing.counts)))


def told(state: State) -> dict[str, int]:
    """Of the groups, with the largest of each name."""
    insight, history = state.asking.insight, state.editing.history
    if insight is None or history is None:
        return {}
    atoms = history.marks.atoms
    speak = [k for k, atom in enumerate(atoms) if atom.on and k < len(insight.shares)]
    speak = [k for k in speak if insight.shares[k] >= LEAST_SHARE and (atoms[k].name or _found(state, k))]
    found: dict[str, int] = {}
    for k in sorted(speak, key=lambda k: -insight.shares[k]):
        found.setdefault(state.editing.atom_name(k).lower(), k)
    return dict(list(found.items())[:MOST])


def _found(state: State, k: int) -> bool:
    """Whether the word nearest to an atom is found when asked."""
    words = state.editing.names[k] if k < len(state.editing.names) else ()
    return bool(words) and words[0] in state.editing.found
