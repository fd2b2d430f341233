"""Fonts of the system for what Roboto lacks: other alphabets, Chinese, Japanese, Korean.

Nothing is shipped and nothing is required: where a system has none, such letters show as boxes.
ImGui draws glyphs as they are needed, so a large font costs its file's mapping and no atlas.
"""

import os
import sys
from pathlib import Path

# Per need, the first that is there. ImGui's loader reads TrueType and OpenType with outlines, also
# in collections, of which it takes the first face.
_WIDE = (
    "DejaVuSans.ttf", "NotoSans-Regular.ttf", "LiberationSans-Regular.ttf",
    "segoeui.ttf", "Arial Unicode.ttf", "Arial.ttf", "arial.ttf",
)  # fmt: skip


_CJK = (
    "NotoSansCJK-Regular.ttc", "NotoSansCJKsc-Regular.otf", "NotoSansSC-Regular.otf",
    "SourceHanSansSC-Regular.otf", "wqy-microhei.ttc", "wqy-zenhei.ttc", "DroidSansFallbackFull.ttf",
    "DroidSansFallback.ttf", "msyh.ttc", "YuGothM.ttc", "meiryo.ttc", "Hiragino Sans GB.ttc",
    "PingFang.ttc", "STHeiti Medium.ttc",
)  # fmt: skip
_KOREAN = ("malgun.ttf", "AppleSDGothicNeo.ttc", "NanumGothic.ttf")
_MOST_FILES = 20_000  # looked at; a folder of fonts beyond this is not searched to its end


def fallbacks(folders: tuple[Path, ...] | None = None) -> list[Path]:
    """Font files to ask after Roboto, in this order."""
    there = _files(font_folders() if folders is None else folders)
    chosen = (
        next((there[name] for name in names if name in there), None) for names in (_WIDE, _CJK, _KOREAN)
    )
    return [file for file in chosen if file is not None]


def font_folders() -> tuple[Path, ...]:
    """Where this platform keeps fonts."""
    home = Path.home()
    if sys.platform == "win32":
        local = Path(os.environ.get("LOCALAPPDATA", home)) / "Microsoft" / "Windows" / "Fonts"
        return (Path(os.environ.get("WINDIR", "C:/Windows")) / "Fonts", local)
    if sys.platform == "darwin":
        return (Path("/System/Library/Fonts"), Path("/Library/Fonts"), home / "Library" / "Fonts")
    return (Path("/usr/share/fonts"), Path("/usr/local/share/fonts"), home / ".local" / "share" / "fonts")


def _files(folders: tuple[Path, ...]) -> dict[str, Path]:
    """Wanted files by name."""
    wanted = {*_WIDE, *_CJK, *_KOREAN}
    found: dict[str, Path] = {}
    seen = 0
    for folder in folders:
        for place, _, names in os.walk(folder):
            for name in wanted.intersection(names):
                found.setdefault(name, Path(place) / name)
            seen += len(names)
            if seen > _MOST_FILES:
                return found
    return found
