"""Lengths for people."""

from langflash_core.base.records import Guess


def said(length: float, metric: float | None, guess: Guess | None = None) -> str:
    """A length for people: in metres where the scene has a scale, about so many where that is a guess."""
    if metric is None:
        if guess is None:
            return f"{length:.3f} units"
        metres = length * guess.metres
        return f"about {100 * metres:.0f} cm" if metres < 1 else f"about {metres:.1f} m"
    metres = length * metric
    return f"{100 * metres:.1f} cm" if metres < 1 else f"{metres:.2f} m"
