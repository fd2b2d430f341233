"""What is in a room: things with names, sizes and places, a plan, and what changed since another scene."""

from langflash_core.inventory.things import Inventory, Thing, inventory

__all__ = ["Inventory", "Thing", "inventory"]
