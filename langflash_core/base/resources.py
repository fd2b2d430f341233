"""Where shaders and assets live: beside the package in a checkout, inside it in a wheel.

And where the user's own weights live: `LANGFLASH_HOME`, else the platform's cache folder.
"""

import os
from pathlib import Path

import platformdirs

_PACKAGE = Path(__file__).resolve().parent.parent
_BUNDLED = _PACKAGE / "_bundled"  # hatch puts shaders/ and assets/ here in a wheel
_ROOT = _BUNDLED if _BUNDLED.is_dir() else _PACKAGE.parent


def shader_path(name: str) -> Path:
    """Path of `shaders/<name>`, e.g. `shader_path("splat/quad.vert")`."""
    return _existing(_ROOT / "shaders" / name)


def asset_path(name: str) -> Path:
    """Path of `assets/<name>`, e.g. `asset_path("photos/books_left.jpg")`."""
    return _existing(_ROOT / "assets" / name)


def home_folder() -> Path:
    """The folder of what was downloaded or converted; it may not exist yet.

    The environment variable LANGFLASH_HOME names it; else it is the platform's folder for caches.
    """
    named = os.environ.get("LANGFLASH_HOME")
    if named:
        return Path(named).expanduser()
    return platformdirs.user_cache_path("langflash", appauthor=False)


def weights_folder() -> Path:
    """Where imported weights live, under `home_folder`."""
    return home_folder() / "weights"


def _existing(path: Path) -> Path:
    if not path.exists():
        raise FileNotFoundError(
            f"LangFlash was installed without {path.name}: expected it at {path}; reinstall the package"
        )
    return path
