"""How finely a scene is made: the sizes of its elements, as people choose them. Imports no torch.

Surfaces are covered by elements whose size follows what the photo shows (`surface/elements.py`): a coarse
layer that is closed by itself, and finer elements on it where the photo has detail.
"""

from dataclasses import dataclass

from langflash_core.errors import InputError

FEWEST, MOST = 1_000, 4_000_000
"""Gaussians that may be asked for."""


@dataclass(frozen=True)
class Detail:
    """One level. most: Gaussians a pixel of the network's grid.
    gain: squared error of three channels that one more Gaussian must take away from the photo, colours in
    [0, 1]: count follows what there is to see. finest: side of the smallest element, pixels of the photo."""

    name: str
    most: float
    gain: float
    finest: int


DETAILS = {
    level.name: level
    for level in (Detail("low", 0.95, 1e-3, 2), Detail("normal", 2.4, 2e-4, 1), Detail("high", 4.8, 5e-5, 1))
}
DEFAULT_DETAIL = "normal"
EXPORT_DETAILS = ("all", "low")
"""How much of a scene's detail an export keeps: all, or none, the coarse layer alone."""


def chosen_detail(name: str) -> Detail:
    """The level of that name.

    Raises:
        InputError: there is none.
    """
    if name not in DETAILS:
        raise InputError(f"the detail '{name}' is unknown; choose {', '.join(DETAILS)}")
    return DETAILS[name]


def check_gaussians(count: int | None) -> None:
    """A number of Gaussians that may be asked for; None: as many as the detail has.

    Raises:
        InputError: it is out of range.
    """
    if count is not None and not FEWEST <= count <= MOST:
        raise InputError(f"{count:,} Gaussians are out of range; choose {FEWEST:,} to {MOST:,}")
