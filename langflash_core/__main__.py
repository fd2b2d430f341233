"""Starts the program: what the command `langflash` and `python -m langflash_core` run.

The program lies beside the library: in a wheel as the package `langflash_app`, in a checkout as the
folder app/. Other people's packages are called `app` too, so that name is never looked up: the folder
is read in from its own place, under the wheel's name. Inside, the program imports itself by relative
names and does not know what it is called.
"""

import gc
import importlib
import importlib.util
import sys
from pathlib import Path
from typing import Any

NAME = "langflash_app"
_BESIDE = Path(__file__).resolve().parent.parent


def main() -> int:
    """Run `langflash` with the words of `sys.argv`; the exit code."""
    find_program()
    code = importlib.import_module(f"{NAME}.cli").main()
    gc.freeze()  # else Python looks for garbage on its way out, half a second among a million objects
    return code


def find_program() -> None:
    """From now on `NAME` can be imported, from a wheel or from a checkout."""
    if NAME not in sys.modules and not (_BESIDE / NAME).is_dir():
        _read_in(_BESIDE / "app")


def in_program(module: str, function: str, *arguments: object) -> Any:
    """Call a function of the program; by names, so that a process that was just started can, too."""
    find_program()
    return getattr(importlib.import_module(f"{NAME}.{module}"), function)(*arguments)


def _read_in(folder: Path) -> None:
    """Make a checkout's folder the package `NAME`."""
    spec = importlib.util.spec_from_file_location(
        NAME, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None and spec.loader is not None  # a .py file has a loader
    package = importlib.util.module_from_spec(spec)
    sys.modules[NAME] = package
    spec.loader.exec_module(package)


if __name__ == "__main__":
    sys.exit(main())
