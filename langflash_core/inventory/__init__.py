"""What is in a room: things with names, sizes and places, a plan, and what changed since another scene.

The package can be called as its function `inventory`: `langflash_core.inventory` names both.
"""

import sys
from types import ModuleType
from typing import Any

from langflash_core.inventory.things import Inventory, Thing, inventory

__all__ = ["Inventory", "Thing", "inventory"]


class _Callable(ModuleType):
    """A module that is its own function, too."""

    def __call__(self, *given: Any, **named: Any) -> Inventory:
        return inventory(*given, **named)


sys.modules[__name__].__class__ = _Callable
