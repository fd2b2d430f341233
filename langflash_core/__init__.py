"""LangFlash: unposed photos to a 3D Gaussian scene that answers words.

    import langflash_core as lf

    scene = lf.reconstruct(["a.jpg", "b.jpg"])
    answer = lf.query(scene, ["armchair", "door"], view=0)
    lf.save(scene, "room.langflash")
    scene = lf.load("room.langflash")  # or .ply, .splat: the suffix says which

The four functions are read in at first use: importing the package alone costs no torch.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from langflash_core.export import export as save  # noqa: F401
    from langflash_core.export import read as load  # noqa: F401
    from langflash_core.pipeline import query as query
    from langflash_core.pipeline import reconstruct as reconstruct

__version__ = "0.1.0"

_HOMES = {
    "reconstruct": ("pipeline", "reconstruct"),
    "query": ("pipeline", "query"),
    "save": ("export", "export"),
    "load": ("export", "read"),
}


class _Package(ModuleType):
    """This package, in which `query` is the function even after the folder `query/` was imported.

    The import system binds every imported sub-module to its package; that would hide a function
    of the same name. `from langflash_core.query import ...` finds the folder all the same.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, own_name = _HOMES[name]
    return getattr(import_module(f"{__name__}.{module}"), own_name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
