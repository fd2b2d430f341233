"""The command line `langflash`.

One sentence on stderr and exit code 2 for bad input, 1 for the rest, 130 for Ctrl-C; with
`--json` one JSON document on stdout and nothing else. Importing this package loads neither
torch nor OpenGL: `langflash --help` and argument errors answer at once.
"""

from .program import main

__all__ = ["main"]
