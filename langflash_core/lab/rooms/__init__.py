"""Furnished rooms: training and test data, made from furniture catalogues and drawn offscreen.

World of a room: metres, y up. World of a sample: its first camera, OpenCV axes.
"""

from langflash_core.lab.rooms.catalogue import (
    HELD_OUT_LIBRARIES,
    TRAIN_LIBRARIES,
    VALIDATION_LIBRARIES,
    Catalogue,
    Item,
    load_catalogue,
)
from langflash_core.lab.rooms.layout import Instance, Room, make_room
from langflash_core.lab.rooms.pack import Pack, build_pack, load_pack
from langflash_core.lab.rooms.preview import contact_sheet
from langflash_core.lab.rooms.render import RoomRenderer
from langflash_core.lab.rooms.sample import RoomViews, StagedRoom, staged_room

__all__ = [
    "HELD_OUT_LIBRARIES",
    "TRAIN_LIBRARIES",
    "VALIDATION_LIBRARIES",
    "Catalogue",
    "Instance",
    "Item",
    "Pack",
    "Room",
    "RoomRenderer",
    "RoomViews",
    "StagedRoom",
    "build_pack",
    "contact_sheet",
    "load_catalogue",
    "load_pack",
    "make_room",
    "staged_room",
]
