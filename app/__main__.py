"""`python -m app` is the command line `langflash`."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
