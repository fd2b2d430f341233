"""Runs `langflash export` beside the window: another process, so no frame waits for it, cancelling
is immediate, and its memory goes with it."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from langflash_core.geometry.poses import Pose, alike, intrinsics, viewmat

_LAST_LINES = 20
_PROGRAM = "langflash_core"  # its __main__ finds the command line, installed or not


class Exporter:
    """At most one export at a time. `say` is called from a thread with (stage, fraction);
    `done` with the exit code, the last line on stdout and the error line."""

    def __init__(self, say: Callable[[str, float], None], done: Callable[[int, str, str], None]) -> None:
        self._say = say
        self._done = done
        self._process: subprocess.Popen[str] | None = None

    @property
    def running(self) -> bool:
        """Whether one is under way."""
        return self._process is not None and self._process.poll() is None

    def start(self, words: Sequence[str]) -> None:
        """Run `langflash` with these words.

        Raises:
            OSError: the process cannot be started.
        """
        environment = {**os.environ, "LANGFLASH_PROGRESS": "lines", "PYTHONUNBUFFERED": "1"}
        root = str(Path(__file__).resolve().parents[__name__.count(".")])  # found also where not installed
        before = environment.get("PYTHONPATH")
        environment["PYTHONPATH"] = root if not before else os.pathsep.join((root, before))
        self._process = subprocess.Popen(
            [sys.executable, "-m", _PROGRAM, *words],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        )
        threading.Thread(target=self._listen, args=(self._process,), daemon=True).start()

    def cancel(self) -> None:
        """End it as Ctrl-C would; nothing half-written stays."""
        if self._process is not None and self.running:
            with suppress(OSError):
                self._process.terminate() if sys.platform == "win32" else self._process.send_signal(2)

    def close(self, patience: float = 2.0) -> None:
        """End it for good."""
        process = self._process
        self._done = lambda *_: None
        if process is None or process.poll() is not None:
            return
        self.cancel()
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def _listen(self, process: "subprocess.Popen[str]") -> None:
        assert process.stdout is not None and process.stderr is not None
        said: list[str] = []
        reader = threading.Thread(target=lambda out: said.extend(out), args=(process.stdout,), daemon=True)
        reader.start()
        complaints: list[str] = []
        for line in process.stderr:
            kind, _, rest = line.rstrip("\n").partition("\t")
            if kind == "progress":
                fraction, _, stage = rest.partition("\t")
                self._say(stage, float(fraction))
            elif kind.strip():
                complaints = [*complaints, line.strip()][-_LAST_LINES:]
        code = process.wait()
        reader.join()
        for stream in (process.stdout, process.stderr):
            stream.close()
        errors = [line.removeprefix("langflash: ") for line in complaints if line.startswith("langflash: ")]
        self._done(code, said[-1].strip() if said else "", errors[-1] if errors else "")


def camera_json(pose: Pose, width: int, height: int) -> bytes:
    """The camera file of `--camera` for a picture of width x height pixels."""
    return json.dumps(_camera(pose, width, height), indent=2).encode()


def keys_json(keys: Sequence[Pose], width: int, height: int) -> bytes:
    """The file of key frames of `--path`."""
    return json.dumps([_camera(key, width, height) for key in alike(keys)], indent=2).encode()


def _camera(pose: Pose, width: int, height: int) -> dict:
    return {
        "viewmat": viewmat(pose).tolist(),
        "K": intrinsics(pose, width, height).tolist(),
        "width": width,
        "height": height,
        "orthographic": pose.span is not None,
    }
