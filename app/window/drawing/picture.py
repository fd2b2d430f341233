"""What the viewport asks of whoever draws its scene."""

from typing import TYPE_CHECKING, Protocol

from ..governor import Governor
from ..state import State
from .marked import Marked
from .values import Stand, View

if TYPE_CHECKING:
    from langflash_core.language.relevance import CompiledQuery

    from .easel import Easel


class ScenePicture(Protocol):
    """Draws one scene as its governor allows. `easel`: what is on show."""

    governor: Governor
    easel: "Easel"

    def ask(self, keys: tuple[int, ...], query: "CompiledQuery | None", revision: int) -> None:
        """Ask other phrases, as `Asked` has them."""
        ...

    def mark(self, marked: Marked) -> None:
        """Show the scene as edits left it."""
        ...

    def update(self, state: State, stand: Stand, touched: float) -> float:
        """Bring the picture up to date; returns seconds until it wants to be called again.

        touched: when the last key or pointer event came, on the clock of `state.now`.
        """
        ...

    def view(self, state: State, stand: Stand) -> View | None:
        """The resting view to score, once per picture and query; None when there is nothing new."""
        ...

    @property
    def whole(self) -> bool:
        """Whether what is on show is the finest that there will be; also where no finer one can be drawn."""
        ...

    @property
    def settling(self) -> bool:
        """Whether a finer picture than the one on show is being drawn."""
        ...

    @property
    def failing(self) -> bool:
        """Whether the finer picture could not be drawn; it is tried again."""
        ...

    def release(self, patience: float) -> None:
        """Stop what is under way, and wait so many seconds for it. What the renderer holds stays."""
        ...
