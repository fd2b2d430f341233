"""A tiny public-domain pack and one renderer for all tests of rooms."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from langflash_core.errors import GraphicsError
from langflash_core.lab.rooms import Pack, RoomRenderer, load_pack

TINY_PACK = Path(__file__).resolve().parents[2] / "fixtures" / "rooms" / "cc0_pack.npz"


@pytest.fixture(scope="session")
def pack() -> Pack:
    return load_pack(TINY_PACK)


@pytest.fixture(scope="session")
def split_pack(pack: Pack) -> Pack:
    """The tiny pack with every other model given to a training library."""
    items = [
        replace(item, library="Scopia") if item.library != "builtin" and number % 2 else item
        for number, item in enumerate(pack.items)
    ]
    return replace(pack, items=tuple(items))


@pytest.fixture(scope="session")
def renderer(pack: Pack) -> Iterator[RoomRenderer]:
    try:
        drawer = RoomRenderer(pack)
    except GraphicsError as error:
        pytest.skip(str(error))
    yield drawer
    assert drawer.ctx.error == "GL_NO_ERROR"
    drawer.release()
    drawer.release()
