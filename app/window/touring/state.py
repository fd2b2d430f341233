"""The touring half of the state. The tour itself is an edit, as key frames are."""

from dataclasses import dataclass

from langflash_core.scene.tour import Note


@dataclass(frozen=True)
class Touring:
    """open: the tour's panel is there. place: of the stop where one went last, from 0; -1: none yet.
    behind: notes that lie behind what the picture shows."""

    open: bool = False
    place: int = -1
    behind: frozenset[Note] = frozenset()


NO_TOURING = Touring()
