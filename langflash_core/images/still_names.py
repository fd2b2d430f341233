"""What frames of a film are called as files, so that photos in a folder or a scene tell film and time."""

import re

_NAME = re.compile(r"(.+ @ )0*(\d+\.\d\d s)\.jpg")


def still_name(film: str, seconds: float, longest: float) -> str:
    """What the file of a frame is called: names in order are times in order."""
    width = len(f"{longest:.2f}")
    return f"{film} @ {seconds:0{width}.2f} s.jpg"


def shown_name(name: str) -> str:
    """`walk.mp4 @ 003.27 s.jpg` is called `walk.mp4 @ 3.27 s`; other files as they are."""
    found = _NAME.fullmatch(name)
    return found[1] + found[2] if found else name


def film_of(name: str) -> str | None:
    """The film that a file is a frame of, by its name."""
    found = _NAME.fullmatch(name)
    return found[1].removesuffix(" @ ") if found else None


def is_still(name: str) -> bool:
    """Whether a file is named as one of a film's frames."""
    return _NAME.fullmatch(name) is not None
