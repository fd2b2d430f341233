"""LangFlash: unposed photos to a 3D Gaussian scene that answers words.

    import langflash_core as lf

    scene = lf.reconstruct(["a.jpg", "b.jpg"])
    answer = lf.query(scene, ["armchair", "door"], view=0)
    lf.save(scene, "room.langflash")
    scene = lf.load("room.langflash")  # or .ply, .splat: the suffix says which
    scene = lf.reconstruct(lf.frames("walk.mp4"))  # the sharpest frames of a film
    lf.write(scene, lf.ExportRequest(Path("plant.png"), what="mask", prompts=("plant",)))  # as `export`

The functions are read in at first use: importing the package alone costs no torch. It settles
how torch's threads will wait (`threads.py`), unless the environment says that already.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from langflash_core.threads import wait_asleep

if TYPE_CHECKING:
    from langflash_core.export import export as save  # noqa: F401
    from langflash_core.export import read as load  # noqa: F401
    from langflash_core.images.frames import frames as frames
    from langflash_core.pipeline import query as query
    from langflash_core.pipeline import reconstruct as reconstruct
    from langflash_core.reconstruction.networks import Networks as Networks
    from langflash_core.request import ExportRequest as ExportRequest
    from langflash_core.writing import write as write

__version__ = "0.1.0"

wait_asleep()

_HOMES = {
    "reconstruct": ("pipeline", "reconstruct"),
    "frames": ("images.frames", "frames"),
    "Networks": ("reconstruction.networks", "Networks"),
    "query": ("pipeline", "query"),
    "save": ("export", "export"),
    "load": ("export", "read"),
    "write": ("writing", "write"),
    "ExportRequest": ("request", "ExportRequest"),
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, own_name = _HOMES[name]
    return getattr(import_module(f"{__name__}.{module}"), own_name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
