"""LangFlash: unposed photos to a 3D Gaussian scene that answers words.

    import langflash_core as lf

    scene = lf.reconstruct(["a.jpg", "b.jpg"])
    lf.save(scene, "room.langflash")
    answer = lf.query("room.langflash", ["armchair", "door"], view=0)
    answer.answers[0].mask  # (H, W) bool: the armchair's pixels in the first photo's view

Make
    reconstruct   photos to a scene
    add_photos    more photos into a finished scene
    frames        the sharpest frames of a film, as photos: lf.reconstruct(lf.frames("walk.mp4"))
    Networks      keeps the network for the next scene

Ask
    query         where in one view are these phrases? Scores, masks, places, boxes
    select        the part of a scene that answers phrases
    segment       which Gaussians, and which connected things, answer each phrase
    inventory     the things of a room: kinds, sizes, places, and what photos show them

Look
    render        one view: colours and depths; a notebook shows it as a picture
    renderer      who draws, kept open for many pictures and questions
    scene.show    the scene as a page in a notebook's cell

Files
    load, save    a scene from and to .langflash, .ply, .splat and more: the suffix says which
    write         all that `langflash export` writes, by an ExportRequest:
                  lf.write(scene, lf.ExportRequest(Path("plant.png"), what="mask", prompts=("plant",)))

A scene may be given as the path of its file. Views are counted from 0 here; the command line, the window
and all files count photos from 1. Whatever cannot be done raises a LangFlashError of one sentence, with what
helps behind its semicolon.
"""

# All is read in at first use: importing the package alone costs no torch. It settles how torch's threads
# will wait (`threads.py`), and that processors help Macs' cards (`devices.py`), unless the environment says
# that already.

from importlib import import_module
from typing import TYPE_CHECKING

from langflash_core.base.devices import let_processor_help
from langflash_core.base.threads import wait_asleep

if TYPE_CHECKING:
    from langflash_core.base.request import ExportRequest as ExportRequest
    from langflash_core.errors import LangFlashError as LangFlashError
    from langflash_core.export import export as save
    from langflash_core.export import read as load
    from langflash_core.images.frames import frames as frames
    from langflash_core.inventory import inventory as inventory
    from langflash_core.pipeline import add_photos as add_photos
    from langflash_core.pipeline import query as query
    from langflash_core.pipeline import reconstruct as reconstruct
    from langflash_core.pipeline import select as select
    from langflash_core.reconstruction.networks import Networks as Networks
    from langflash_core.segments import segment as segment
    from langflash_core.writing import write as write
    from langflash_core.writing.rendering import render as render
    from langflash_core.writing.rendering import renderer as renderer

__version__ = "0.1.0"

wait_asleep()
let_processor_help()

_HOMES = {
    "reconstruct": ("pipeline", "reconstruct"),
    "add_photos": ("pipeline", "add_photos"),
    "frames": ("images.frames", "frames"),
    "Networks": ("reconstruction.networks", "Networks"),
    "query": ("pipeline", "query"),
    "select": ("pipeline", "select"),
    "segment": ("segments", "segment"),
    "render": ("writing.rendering", "render"),
    "renderer": ("writing.rendering", "renderer"),
    "save": ("export", "export"),
    "load": ("export", "read"),
    "write": ("writing", "write"),
    "ExportRequest": ("base.request", "ExportRequest"),
    "LangFlashError": ("errors", "LangFlashError"),
}
_SELVES = ("inventory",)  # packages of that name, which can be called

# What help() tells one by one below the page; classes have pages of their own.
__all__ = ["add_photos", "frames", "inventory", "load", "query", "reconstruct", "render", "renderer", "save",
           "segment", "select", "write"]  # fmt: skip


def __getattr__(name: str) -> object:
    if name in _SELVES:
        return import_module(f"{__name__}.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, own_name = _HOMES[name]
    return getattr(import_module(f"{__name__}.{module}"), own_name)


def __dir__() -> list[str]:
    return sorted((*_HOMES, *_SELVES, "__version__"))
