"""Which scene files there are, and which colour maps, by name alone: light enough for the command line and
the window to ask.

A name ends in a suffix, or in `.compressed.ply`, or is a whole one:
`meta.json` is a SOG in a folder, `cameras.txt` COLMAP's model in one.
"""

from pathlib import Path

COMPRESSED_PLY = ".compressed.ply"
SOG_FOLDER = "meta.json"
USD = (".usd", ".usda", ".usdc", ".usdz")
SCENES_IN = (".langflash", ".ply", ".splat", ".spz", ".sog", SOG_FOLDER, ".ksplat", ".glb", ".gltf", *USD)
SCENES_OUT = (".langflash", ".ply", COMPRESSED_PLY, ".splat", ".spz", ".sog", SOG_FOLDER, ".glb", *USD)
CAMERAS_OUT = ("cameras.txt", "transforms.json")  # and the photos, in images/ beside
ANSWERS_OUT = (".json", ".csv")  # of phrases
FILMS_OUT = (".mp4", ".webp")
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
DEPTH_OUT = ".exr"
PAGE_OUT = ".html"  # the whole scene, to be looked at and asked; no program reads it back
ALL_OUT = (".png", *SCENES_OUT, *CAMERAS_OUT, *ANSWERS_OUT, *FILMS_OUT, ".npz", DEPTH_OUT, PAGE_OUT)
"""What `langflash export` writes."""
DROPPED = tuple(kind for kind in SCENES_IN if kind.startswith("."))  # a meta.json may be anything


def kind_of(path: Path) -> str:
    """What the name of a file says it is: its suffix in lower case, or one of the longer names above."""
    name = path.name.lower()
    if name in (SOG_FOLDER, *CAMERAS_OUT):
        return name
    return COMPRESSED_PLY if name.endswith(COMPRESSED_PLY) else path.suffix.lower()


def is_film(path: Path) -> bool:
    """Whether the name says that it is a film."""
    return path.suffix.lower() in FILMS_IN


COLOUR_MAPS = ("heat", "viridis", "cividis", "inferno", "turbo", "grey")
"""By name. The first is everybody's usual one, in window, files and command line."""
