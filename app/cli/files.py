"""Scene files and photos that a command reads, checked before torch is loaded."""

from collections.abc import Sequence
from pathlib import Path

from langflash_core.base.files import photos_in, readable_file
from langflash_core.base.formats import is_film
from langflash_core.errors import ImageError, SceneFileError


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


def out_of_folders(given: Sequence[Path]) -> list[Path]:
    """Files, each folder replaced by the photos in it, or else its films.

    Raises:
        ImageError: a folder cannot be read or holds none.
    """
    listed = list[Path]()
    for path in given:
        found = photos_in(path) if path.is_dir() else [path]
        if not found:
            raise ImageError(
                f"the folder {path} holds no photos and no films; choose one that does, or use "
                "langflash batch where its sub-folders hold them"
            )
        listed += found
    return listed


def checked_photos(given: Sequence[Path]) -> list[Path]:
    """Photos and films, `out_of_folders`; photos open.

    Raises:
        ImageError: a photo is missing or does not open, a folder cannot be read or holds none.
    """
    listed = out_of_folders(given)
    for path in listed:
        if not is_film(path):
            readable_file(path, "photo", ImageError)
    return listed
