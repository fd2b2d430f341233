"""`langflash desktop`: an entry in the menu of a Linux desktop, its icon, and the type of .langflash files.

They go to the user's own XDG folder of data. Three files are written, by us alone, and the same three are
taken away.

Source: the Desktop Entry, Icon Theme and Shared MIME-info specifications of freedesktop.org.
"""

import os
import shutil
import subprocess
import sys
from argparse import Namespace
from pathlib import Path
from typing import TextIO

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.resources import asset_path
from langflash_core.errors import InputError, OutputError

TYPE = "application/x-langflash-scene"
MARK = "LangFlash"  # in every file of ours
ENTRY, ICON, KIND = (
    "applications/langflash.desktop",
    "icons/hicolor/scalable/apps/langflash.svg",
    "mime/packages/langflash.xml",
)
_DATABASES = (("update-mime-database", "mime"), ("update-desktop-database", "applications"))


def run(args: Namespace, out: TextIO) -> None:
    """Write or remove the files of the desktop."""
    if not sys.platform.startswith("linux"):
        raise InputError(
            "the desktop entry is for Linux; on other systems choose the program for a file by hand"
        )
    paths = install(data_folder(), own_command()) if args.install else remove(data_folder())
    for path in paths:
        print(path if args.install else f"removed {path}", file=out)
    if not paths:
        print("nothing was installed", file=out)


def data_folder() -> Path:
    """XDG_DATA_HOME where it is an absolute path, as its specification says, else ~/.local/share."""
    named = os.environ.get("XDG_DATA_HOME", "")
    return Path(named) if os.path.isabs(named) else Path.home() / ".local" / "share"


def own_command() -> list[str]:
    """What starts this program from anywhere."""
    started = Path(sys.argv[0])
    if getattr(sys, "frozen", False):
        return [sys.executable]
    if started.name.startswith("langflash") and os.access(started, os.X_OK) and started.suffix != ".py":
        return [str(started.resolve())]
    return [sys.executable, "-m", "langflash_core"]


def contents(command: list[str]) -> dict[str, str]:
    """What each file holds, by its place in the folder of data."""
    words = " ".join(map(_quoted, command))
    entry = f"""[Desktop Entry]
Type=Application
Name={MARK}
GenericName=3D scenes from photos
Comment=Photos to a 3D scene that answers words
Exec={words} view %F
Icon=langflash
Terminal=false
Categories=Graphics;3DGraphics;
Keywords=gaussian;splatting;photogrammetry;
MimeType={TYPE};
StartupWMClass={MARK}
"""
    kind = f"""<?xml version="1.0" encoding="UTF-8"?>
<mime-info xmlns="http://www.freedesktop.org/standards/shared-mime-info">
  <mime-type type="{TYPE}">
    <comment>{MARK} scene</comment>
    <icon name="langflash"/>
    <glob pattern="*.langflash"/>
  </mime-type>
</mime-info>
"""
    return {ICON: asset_path("icon.svg").read_text(encoding="utf-8"), KIND: kind, ENTRY: entry}


def install(folder: Path, command: list[str]) -> list[Path]:
    """Write the files, all or none; their paths.

    Raises:
        InputError: a file of somebody else has the name. OutputError: one cannot be written.
    """
    wanted = {folder / name: text for name, text in contents(command).items()}
    before = {path: _own_text(path) for path in wanted}
    done: list[Path] = []
    try:
        for path, text in wanted.items():
            make_folder(path.parent)
            write_atomically(path, text.encode())
            done.append(path)
    except OutputError:
        for path in done:
            _put_back(path, before[path])
        raise
    _tell(folder)
    return done


def remove(folder: Path) -> list[Path]:
    """Take the files away; the paths of those that were there.

    Raises:
        InputError: a file of somebody else has the name. OutputError: one cannot be removed.
    """
    there = [path for name in (ENTRY, KIND, ICON) if _own_text(path := folder / name) is not None]
    for path in there:
        try:
            path.unlink()
        except OSError as error:
            raise OutputError(f"cannot remove {path}: {error.strerror}; check its permissions") from error
    _tell(folder)
    return there


def _own_text(path: Path) -> str | None:
    """What a file of ours holds; None where there is none.

    Raises:
        InputError: it is not ours.
    """
    if not path.exists():
        return None
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError):
        text = ""
    if MARK not in text:
        raise InputError(f"{path} is not LangFlash's; move it away first")
    return text


def _put_back(path: Path, text: str | None) -> None:
    if text is None:
        path.unlink(missing_ok=True)
    else:
        write_atomically(path, text.encode())


def _tell(folder: Path) -> None:
    """The desktop's own indices, where there are programs for them; it finds the files without, too, but
    later."""
    for program, below in _DATABASES:
        found = shutil.which(program)
        if found and (folder / below).is_dir():
            subprocess.run([found, str(folder / below)], capture_output=True, timeout=60, check=False)


def _quoted(word: str) -> str:
    """A word of Exec: quoted, and what is special in quotes, in strings and in field codes escaped."""
    inside = "".join("\\\\" + letter if letter in '"`$\\' else letter for letter in word)
    return '"' + inside.replace("%", "%%") + '"'
