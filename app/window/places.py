"""Where the program keeps what outlives it, per platform.

`LANGFLASH_CONFIG` and `LANGFLASH_STATE` name other folders, for tests and for tidy people.
"""

import os
from pathlib import Path

import platformdirs


def config_folder() -> Path:
    """Preferences."""
    own = os.environ.get("LANGFLASH_CONFIG")
    return Path(own) if own else platformdirs.user_config_path("langflash", appauthor=False)


def state_folder() -> Path:
    """What a crash must not take, and what may be thrown away."""
    own = os.environ.get("LANGFLASH_STATE")
    return Path(own) if own else platformdirs.user_state_path("langflash", appauthor=False)
