"""What is asked of every set of a run."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from langflash_core.base.detail import DEFAULT_DETAIL


@dataclass(frozen=True)
class Order:
    """Options as `langflash reconstruct`, `query` and `export` have them.

    prompts: phrases to answer in the first photo's view. exports: endings (".ply") or whole names
    ("transforms.json") of the files that are wanted besides the scene. backend: "gl", "torch", or None for
    gl where it is there.
    """

    preset: str = "mini"
    weights: Path | None = None
    size: int | None = None
    detail: str = DEFAULT_DETAIL
    gaussians: int | None = None
    fov: float | None = None
    device: str = "auto"
    prompts: tuple[str, ...] = ()
    exports: tuple[str, ...] = ()
    backend: str | None = None

    def words(self) -> Mapping[str, Any]:
        """As plain JSON values, a checkpoint by its name, size and time of change."""
        return {**asdict(self), "weights": None if self.weights is None else stamp(self.weights)}


def stamp(path: Path) -> tuple[str, int, int]:
    """Name, bytes and time of change of a file; -1 where there is none."""
    try:
        known = path.stat()
    except OSError:
        return path.name, -1, -1
    return path.name, known.st_size, known.st_mtime_ns


def export_path(ending: str) -> Path:
    """What a file besides the scene is called in its set's folder."""
    return Path(f"scene{ending}" if ending.startswith(".") else ending)
