"""How the threads of one process wait for each other, settled before torch is loaded."""

import os

# A person who has set any of these knows better. OpenMP's own, GNU's, and LLVM's and Intel's.
_SETTINGS = ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME")
_SPINS = 3000  # about 30 microseconds: bridges most gaps between loops, and ends before a neighbour minds


def wait_asleep() -> None:
    """Let threads that wait for each other sleep instead of spinning, but for the shortest waits.

    Spinning for milliseconds, as libgomp does by itself, burns on a busy processor the time that the
    awaited thread needs; sleeping at once costs every loop of an idle one. OpenMP (libgomp on Linux,
    libomp on macOS, libiomp on Windows) reads the variables once, when torch loads it; only libgomp
    knows the number of spins.
    """
    if not any(name in os.environ for name in _SETTINGS):
        os.environ["OMP_WAIT_POLICY"] = "PASSIVE"
        os.environ["GOMP_SPINCOUNT"] = str(_SPINS)
