"""What the name of a file says, which photos and films are read, and which colour maps there are: light
enough for the command line and the window to ask. What is written is in `outputs.py`.

A name ends in a suffix, or in `.compressed.ply`, or is a whole one:
`meta.json` is a SOG in a folder, `cameras.txt` COLMAP's model in one.
"""

from pathlib import Path

COMPRESSED_PLY = ".compressed.ply"
SOG_FOLDER = "meta.json"
USD = (".usd", ".usda", ".usdc", ".usdz")
FILMS_IN = (
    ".mp4",
    ".mov",
    ".m4v",
    ".mkv",
    ".webm",
    ".avi",
    ".3gp",
    ".mts",
    ".m2ts",
    ".mpg",
    ".mpeg",
    ".wmv",
    ".ogv",
)
"""Films that scenes are made of."""
PHOTOS_IN = (
    ".jpg",
    ".jpeg",
    ".jpe",
    ".jfif",
    ".mpo",
    ".png",
    ".apng",
    ".webp",
    ".heic",
    ".heics",
    ".heif",
    ".heifs",
    ".hif",
    ".avif",
    ".avifs",
    ".tif",
    ".tiff",
    ".jp2",
    ".j2k",
    ".j2c",
    ".jpc",
    ".jpf",
    ".jpx",
    ".bmp",
    ".gif",
    ".ppm",
    ".pgm",
    ".pbm",
    ".pnm",
)
"""Photos, by every usual name of what `picture_files.py` opens; but .pfm, which are depth beside photos."""
LARGEST_SIDE = 8192  # pixels of a picture; GL 3.3 promises no larger texture on most drivers
AXES = (
    "ldb", "rdb", "lub", "rub", "ldf", "rdf", "luf", "ruf", "lfd", "rfd", "lfu", "rfu", "lbd", "rbd", "lbu",
    "rbu",
)  # fmt: skip
"""Where +x, +y and +z of a .spz may point: right or left, up or down, front or back; in the order of their
numbers in such files, from 1. A `Scene` is rdf."""
_WHOLE_NAMES = (SOG_FOLDER, "cameras.txt", "transforms.json")


def kind_of(path: Path) -> str:
    """What the name of a file says it is: its suffix in lower case, or one of the longer names above."""
    name = path.name.lower()
    if name in _WHOLE_NAMES:
        return name
    return COMPRESSED_PLY if name.endswith(COMPRESSED_PLY) else path.suffix.lower()


def is_film(path: Path) -> bool:
    """Whether the name says that it is a film."""
    return path.suffix.lower() in FILMS_IN


def is_photo(path: Path) -> bool:
    """Whether the name says that it is a photo."""
    return path.suffix.lower() in PHOTOS_IN


COLOUR_MAPS = ("heat", "viridis", "cividis", "inferno", "turbo", "grey")
"""By name. The first is everybody's usual one, in window, files and command line."""
