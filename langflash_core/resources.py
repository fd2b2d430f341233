"""Where shaders and assets live: beside the package in a checkout, inside it in a wheel."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_BUNDLED = _PACKAGE / "_bundled"  # hatch puts shaders/ and assets/ here in a wheel
_ROOT = _BUNDLED if _BUNDLED.is_dir() else _PACKAGE.parent


def shader_path(name: str) -> Path:
    """Path of `shaders/<name>`, e.g. `shader_path("splat/quad.vert")`."""
    return _existing(_ROOT / "shaders" / name)


def asset_path(name: str) -> Path:
    """Path of `assets/<name>`, e.g. `asset_path("photos/books_left.jpg")`."""
    return _existing(_ROOT / "assets" / name)


def _existing(path: Path) -> Path:
    if not path.exists():
        raise FileNotFoundError(
            f"LangFlash was installed without {path.name}: expected it at {path}; reinstall the package"
        )
    return path
