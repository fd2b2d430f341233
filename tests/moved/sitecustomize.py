"""Python runs this first where this folder is on PYTHONPATH: processes of tests with moved products."""

import importlib
import sys
from importlib.machinery import ModuleSpec, PathFinder
from typing import Any

_MOVERS = {"torch": ("tests.moved.products", "move_products"), "numpy": ("tests.moved.arrays", "move_arrays")}


class _Moving:
    """Lets torch and NumPy be imported as ever, and then moves their products."""

    @staticmethod
    def find_spec(name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        spec = PathFinder.find_spec(name, path, target) if name in _MOVERS else None
        if spec and spec.loader:
            load = spec.loader.exec_module

            def load_and_move(module: Any) -> None:
                load(module)
                within, mover = _MOVERS[name]
                getattr(importlib.import_module(within), mover)()

            spec.loader.exec_module = load_and_move
        return spec


sys.meta_path.insert(0, _Moving)  # type: ignore[arg-type]
