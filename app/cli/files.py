"""Scene files that a command reads, checked before torch is loaded."""

from pathlib import Path

from langflash_core.errors import SceneFileError
from langflash_core.files import readable_file


def checked_scene(path: Path) -> Path:
    """`path`, when it opens and, if it is one of our own files, is whole by its header; without torch.

    Raises:
        SceneFileError: missing, truncated, foreign, or of a newer version.
    """
    readable_file(path, "scene", SceneFileError)
    if path.suffix.lower() == ".langflash":
        from langflash_core.scene.container import check_container

        check_container(path)
    return path
