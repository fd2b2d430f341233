"""Copied text as paths: what file managers, shells and browsers put on the clipboard when files are copied.

No part of it is cut off; a list ends where its text does.
"""

import os
import re
import sys
from urllib.parse import unquote_to_bytes

_ADDRESS = re.compile(r"file:(//[^/]*)?(?=/)", re.IGNORECASE)
_ENDS = re.compile(r"\r\n|\n|\r|\0")  # of lines; not what else `splitlines` takes for one: names may have it
_HEADINGS = frozenset(("x-special/nautilus-clipboard", "x-special/gnome-copied-files", "copy", "cut"))
_QUOTES = ("'", '"')


def pasted_paths(text: str) -> tuple[str, ...]:
    """Paths and file addresses in copied text, a line each, whether they are there or not; none where a line
    is something else."""
    lines = [line for line in _ENDS.split(text) if line.strip()]
    while lines and lines[0].strip() in _HEADINGS and len(lines) > 1:
        lines = lines[1:]
    if any(map(_ADDRESS.match, lines)):
        lines = [line for line in lines if not line.startswith("#")]  # comments, RFC 2483
    paths: list[str] = []
    for line in lines:
        path = _path(line)
        if path is None:
            return ()
        paths.append(path)
    return tuple(paths)


def _path(line: str) -> str | None:
    """What a line names: as it stands, without blanks around it, or without quotes around that; None where
    that is neither there nor whole from the root on."""
    address = _ADDRESS.match(line.strip())
    if address:
        return _decoded(line.strip()[address.end() :])
    bare = line.strip()
    quoted = len(bare) > 1 and bare[0] == bare[-1] and bare[0] in _QUOTES
    named = [os.path.expanduser(name) for name in (line, bare, *([bare[1:-1]] if quoted else ()))]
    there = next((name for name in named if os.path.exists(name)), None)
    return there or (named[-1] if os.path.isabs(named[-1]) else None)


def _decoded(path: str) -> str:
    """The path of an address; `#` and `?` are letters of names there, which not every program encodes."""
    decoded = os.fsdecode(unquote_to_bytes(path))
    return decoded.lstrip("/") if sys.platform == "win32" else decoded


def same_text(field: str, copied: str) -> bool:
    """Whether a field of one line holds copied text, whose ends of lines are blanks there."""
    return bool(copied.strip()) and field.split() == copied.split()
