"""Which steps through our own code a call takes: pairs of lines that followed each other in one frame.

Only frames of `langflash_core/` and `app/` are followed, so numpy and torch run as fast as ever.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

_ROOT = str(Path(__file__).resolve().parents[2])
OURS = (f"{_ROOT}/langflash_core", f"{_ROOT}/app")
_known: dict[CodeType, bool] = {}


def steps_of(call: Callable[[], object]) -> tuple[set[tuple[int, int, int]], BaseException | None]:
    """The steps (code, line before, line), and what it raised."""
    steps: set[tuple[int, int, int]] = set()

    def entered(frame: FrameType, event: str, _: Any) -> Callable | None:
        code = frame.f_code
        ours = _known.get(code)
        if ours is None:
            ours = _known[code] = code.co_filename.startswith(OURS)
        if not ours:
            return None
        # By name, not by identity: an inner function's code is made once, but its number differs by run.
        number, last = hash((code.co_filename, code.co_name, code.co_firstlineno)), code.co_firstlineno

        def went(frame: FrameType, event: str, _: Any) -> Callable:
            nonlocal last
            if event == "line":
                steps.add((number, last, frame.f_lineno))
                last = frame.f_lineno
            return went

        return went

    before = sys.gettrace()
    sys.settrace(entered)
    try:
        call()
    except BaseException as error:
        return steps, error
    finally:
        sys.settrace(before)
    return steps, None
