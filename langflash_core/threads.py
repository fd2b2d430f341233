"""How the threads of one process wait for each other, settled before torch is loaded."""

import os

# A person who has set any of these knows better. OpenMP's own, GNU's, and LLVM's and Intel's.
_SETTINGS = ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME")


def wait_asleep() -> None:
    """Let threads that wait for each other sleep instead of spinning.

    Spinning saves a few microseconds a loop while a processor is all ours; on a busy one every
    thread burns the time that the thread it waits for needs. OpenMP (libgomp on Linux, libomp on
    macOS, libiomp on Windows) reads the variable once, when torch loads it.
    """
    if not any(name in os.environ for name in _SETTINGS):
        os.environ["OMP_WAIT_POLICY"] = "PASSIVE"
