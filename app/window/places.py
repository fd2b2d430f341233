"""Where the program keeps what outlives it, per platform.

`LANGFLASH_CONFIG` and `LANGFLASH_STATE` name other folders, for tests and for tidy people.
"""

import os
import sys
from pathlib import Path


def config_folder() -> Path:
    """Preferences."""
    own = os.environ.get("LANGFLASH_CONFIG")
    if own:
        return Path(own)
    if sys.platform == "win32":
        return Path(os.environ.get("APPDATA", Path.home())) / "langflash"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Preferences" / "langflash"
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "langflash"


def state_folder() -> Path:
    """What a crash must not take, and what may be thrown away."""
    own = os.environ.get("LANGFLASH_STATE")
    if own:
        return Path(own)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "langflash"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "langflash"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "langflash"
