"""Random input may save, export or delete anything: Python processes started with `environment`
cannot write or remove a file outside one folder, nor start a program but Python and the encoder."""

import os
import sys
from pathlib import Path

FOLDER = "LANGFLASH_TEST_FOLDER"
REFUSED = "refused.txt"
HOMES = {
    "HOME": "home", "LANGFLASH_CONFIG": "config", "LANGFLASH_STATE": "state", "TMPDIR": "tmp",
    "XDG_CACHE_HOME": "cache", "XDG_CONFIG_HOME": "xdg-config", "XDG_STATE_HOME": "xdg-state",
}  # fmt: skip
_CHANGES = {
    "os.remove": 1, "os.rename": 2, "os.rmdir": 1, "os.mkdir": 1, "os.truncate": 1, "os.link": 2,
    "os.symlink": 2, "os.chmod": 1, "os.utime": 1,
}  # fmt: skip
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


def environment(folder: Path, root: Path) -> dict[str, str]:
    """For a program that finds its code in `root` and may change only `folder`, which is prepared."""
    for name in HOMES.values():
        (folder / name).mkdir(parents=True, exist_ok=True)
    start = folder / "start"
    start.mkdir(exist_ok=True)
    hook = "from tests.app.window.guarded import guard\nguard()\n"
    (start / "sitecustomize.py").write_text(hook)  # Python runs it before everything else
    homes = {variable: str(folder / name) for variable, name in HOMES.items()}
    paths = os.pathsep.join((str(start), str(root)))
    own = {FOLDER: str(folder.resolve()), "PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
    return {**os.environ, **homes, **own}


def guard() -> None:
    """Refuse from here on, and note what was refused in the folder."""
    folder = os.environ[FOLDER]
    notes = os.open(os.path.join(folder, REFUSED), os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)

    def refuse(what: str) -> None:
        os.write(notes, f"{what}\n".encode(errors="replace"))
        raise PermissionError(13, "Permission denied by the test", what)

    def check(event: str, args: tuple) -> None:
        if event == "open":
            path, mode, flags = args
            if isinstance(path, int) or not (_writes(mode) or (flags or 0) & _WRITING):
                return
            if not _inside(path, folder):
                refuse(f"open {os.fsdecode(path)}")
        elif event in _CHANGES:
            for path in args[: _CHANGES[event]]:
                if not isinstance(path, int) and not _inside(path, folder):
                    refuse(f"{event} {os.fsdecode(path)}")
        elif event == "subprocess.Popen":
            name = os.path.basename(os.fsdecode(args[0] or args[1][0]))
            if not name.startswith((os.path.basename(sys.executable), "python", "ffmpeg")):
                refuse(f"start {name}")

    sys.addaudithook(check)


def _writes(mode) -> bool:
    return isinstance(mode, str) and any(letter in mode for letter in "wax+")


def _inside(path, folder: str) -> bool:
    place = os.path.realpath(os.fsdecode(path))
    return place == os.devnull or place == folder or place.startswith(folder + os.sep)
