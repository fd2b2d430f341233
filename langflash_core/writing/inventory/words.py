"""How lengths and sureness are said on plans and pages."""

from langflash_core.base.records import Guess
from langflash_core.inventory.plan import Plan
from langflash_core.inventory.things import Thing

SURE = 0.95
"""From here on a thing is what it is called; below it may be."""
THIN = "photos show one side of it, so its depth is not known"


def doubt_of(thing: Thing, plan: Plan | None = None) -> str:
    """Why a thing may not be as it is listed, or ""."""
    if thing.sure < SURE:
        return "it may be something else"
    if thing.thin:
        return THIN
    return "it goes through a wall" if plan is not None and thing.id in plan.astray else ""


def length(value: float, unit: str) -> str:
    """`1.40 m`, or `0.55 units`."""
    return f"{value:.2f} {unit}"


def size(thing: Thing, unit: str) -> str:
    """Width, depth and height in one line."""
    return f"{' × '.join(f'{side:.2f}' for side in thing.size)} {unit}"


def scale_note(guess: Guess | None, unit: str) -> str:
    """Where lengths come from, in a sentence."""
    if guess is not None:
        by = ", ".join(guess.by)
        return f"Lengths are a guess, within about {guess.spread:.0%}, from: {by}."
    return "Lengths are as they were told." if unit == "m" else "Lengths are in the scene's own unit."
