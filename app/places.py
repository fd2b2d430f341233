"""Where the program keeps what outlives it, per platform, and the small pictures that it shows of scenes.

`LANGFLASH_CONFIG` and `LANGFLASH_STATE` name other folders, for tests and for tidy people.
"""

import os
from collections.abc import Iterable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

import platformdirs

PROJECT = "project-"
"""What files of scenes that were open lately begin with (`app/window/recovery/records.py`)."""
PICTURE = ".jpg"
"""Ending of its small picture (`app/window/recovery/tiles.py`)."""


def config_folder() -> Path:
    """Preferences."""
    own = os.environ.get("LANGFLASH_CONFIG")
    return Path(own) if own else platformdirs.user_config_path("langflash", appauthor=False)


def state_folder() -> Path:
    """What a crash must not take, and what may be thrown away."""
    own = os.environ.get("LANGFLASH_STATE")
    return Path(own) if own else platformdirs.user_state_path("langflash", appauthor=False)


def earlier_projects() -> Path:
    """Where earlier versions kept what they remembered of scenes, without `PROJECT` before its name."""
    return config_folder() / "projects"


def project_file(scene: str, suffix: str) -> Path:
    """What is kept of the scene with this path: under the digest of that. suffix: PICTURE for its small
    picture."""
    return state_folder() / f"{PROJECT}{sha256(os.fsencode(scene)).hexdigest()[:24]}{suffix}"


def forget_pictures(scenes: Iterable[Path]) -> None:
    """Remove the small pictures of scenes, whichever way their paths were given; none there is fine."""
    for scene in scenes:
        for name in {str(scene), str(scene.absolute()), str(scene.resolve())}:
            file = project_file(name, PICTURE)
            for place in (file, earlier_projects() / file.name.removeprefix(PROJECT)):
                with suppress(OSError):
                    place.unlink(missing_ok=True)
