"""The touring half of the state. The tour itself is an edit, as key frames are."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Touring:
    """open: the tour's panel is there. place: of the stop where one went last, from 0; -1: none yet."""

    open: bool = False
    place: int = -1


NO_TOURING = Touring()
