"""What the viewport asks of whoever draws its scene."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from ..governor import Governor
from ..state import State
from .marked import Marked
from .values import Stand, View

if TYPE_CHECKING:
    from langflash_core.language.relevance import CompiledQuery

    from .easel import Easel


class ScenePicture(ABC):
    """Draws one scene as its governor allows. `easel`: what is on show."""

    governor: Governor
    easel: "Easel"

    def ask(self, keys: tuple[int, ...], query: "CompiledQuery | None", revision: int) -> None:
        """Ask other phrases, as `Asked` has them."""
        self.easel.ask(keys, query, revision)

    def mark(self, marked: Marked) -> None:
        """Show the scene as edits left it."""
        self.easel.mark(marked)

    @abstractmethod
    def update(self, state: State, stand: Stand, touched: float) -> float:
        """Bring the picture up to date; returns seconds until it wants to be called again.

        touched: when the last key or pointer event came, on the clock of `state.now`.
        """

    @abstractmethod
    def view(self, state: State, stand: Stand) -> View | None:
        """The resting view to score, once per picture and query; None when there is nothing new."""

    @property
    def whole(self) -> bool:
        """Whether what is on show is the finest that there will be; also where no finer one can be drawn."""
        return self.easel.finest

    @property
    def settling(self) -> bool:
        """Whether a finer picture than the one on show is being drawn."""
        return False

    @property
    def failing(self) -> bool:
        """Whether the finer picture could not be drawn; it is tried again."""
        return False

    def release(self, patience: float) -> None:  # noqa: B027
        """Stop what is under way, and wait so many seconds for it. What the renderer holds stays."""
