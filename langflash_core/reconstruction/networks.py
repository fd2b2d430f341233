"""The network that was read last, for whoever makes one scene after the other. Imports no torch."""

from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from langflash_core.network.model import LangFlashNet


class Networks:
    """Reads weights once: a window, a worker of a batch or a judgement holds one, and hands it to
    `pipeline.reconstruct` for every scene. It keeps one network, because two are too much memory.
    """

    def __init__(self) -> None:
        self._key: Hashable = None
        self._network: LangFlashNet | None = None

    def get(self, key: Hashable, read: Callable[[], "LangFlashNet"]) -> "LangFlashNet":
        """What `read` gives, or gave last time where `key`, all that the network hangs on, is the same."""
        if self._network is None or self._key != key:
            self._network = None  # goes before the other comes
            self._key, self._network = key, read()
        return self._network
