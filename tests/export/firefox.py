"""A Firefox on a screen of its own (Xvfb) that is driven by its own protocol (Marionette), where one is
installed; without a screen it draws no WebGL. Nothing of the network reaches it."""

import base64
import json
import os
import re
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

SECONDS = 120  # that an answer may take
PREFERENCES = {
    "webgl.force-enabled": True,
    "network.proxy.type": 1,  # everything goes to a port where nobody answers
    "network.proxy.http": "127.0.0.1", "network.proxy.http_port": 9,
    "network.proxy.ssl": "127.0.0.1", "network.proxy.ssl_port": 9,
    "app.update.enabled": False, "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False, "marionette.port": 0,
}  # fmt: skip


def program() -> str | None:
    """Its path; `LANGFLASH_FIREFOX` names another one than that of the system."""
    return os.environ.get("LANGFLASH_FIREFOX") or shutil.which("firefox") or shutil.which("firefox-esr")


class Firefox:
    """One page."""

    def __init__(self, connection: socket.socket):
        self._connection, self._left, self._number = connection, b"", 0
        self._message()
        self.call("WebDriver:NewSession", capabilities={"alwaysMatch": {"acceptInsecureCerts": True}})
        self.call("WebDriver:SetTimeouts", script=1000 * SECONDS, pageLoad=1000 * SECONDS)

    def call(self, method: str, **params: Any) -> Any:
        """The result of a call."""
        self._number += 1
        text = json.dumps([0, self._number, method, params]).encode()
        self._connection.sendall(b"%d:%s" % (len(text), text))
        _, _, error, result = self._message()
        assert error is None, error
        return result

    def open(self, path: Path, size: tuple[int, int], fragment: str = "") -> None:
        """Show a page in a window of a size and wait until it is read."""
        self.call("WebDriver:SetWindowRect", width=size[0], height=size[1])
        self.call("WebDriver:Navigate", url="about:blank")
        self.call("WebDriver:Navigate", url=path.resolve().as_uri() + fragment)

    def value(self, expression: str) -> Any:
        """What an expression gives, after its promise, as JSON."""
        # The page's policy lets nothing evaluate texts, so the expression is written into the script.
        script = (
            f"const done = arguments[0]; Promise.resolve().then(() => ({expression}))"
            ".then((value) => done({value}), (error) => done({error: String(error)}))"
        )
        found = self.call("WebDriver:ExecuteAsyncScript", script=script, args=[], sandbox=None)["value"]
        assert "error" not in found, found["error"]
        return found.get("value")

    def screenshot(self) -> bytes:
        """The page as a PNG."""
        return base64.b64decode(self.call("WebDriver:TakeScreenshot", full=False)["value"])

    def _message(self) -> Any:
        while b":" not in self._left:
            self._receive()
        length, _, self._left = self._left.partition(b":")
        while len(self._left) < int(length):
            self._receive()
        message, self._left = self._left[: int(length)], self._left[int(length) :]
        return json.loads(message)

    def _receive(self) -> None:
        part = self._connection.recv(1 << 20)
        assert part, "the browser is gone"
        self._left += part


@contextmanager
def firefox(profile: Path) -> Iterator[Firefox]:
    """A Firefox with an empty profile in a folder, ended with the block."""
    found = program()
    assert found is not None
    profile.mkdir(parents=True)
    lines = (f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in PREFERENCES.items())
    (profile / "user.js").write_text("\n".join(lines))
    screen, number = _screen()
    running = subprocess.Popen(
        [found, "--marionette", "--no-remote", "--profile", str(profile)],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        start_new_session=True, env={**os.environ, "HOME": str(profile), "DISPLAY": f":{number}",
        "LIBGL_ALWAYS_SOFTWARE": "1"},
    )  # fmt: skip
    try:
        with socket.create_connection(("127.0.0.1", _port(profile)), SECONDS) as connection:
            yield Firefox(connection)
    finally:
        for process in (running, screen):
            process.terminate()
            try:
                process.wait(15)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _screen() -> tuple[subprocess.Popen, int]:
    """An X server, and the number that it chose."""
    read, write = os.pipe()
    words = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1400x1000x24", "-nolisten", "tcp", "-noreset"]
    server = subprocess.Popen(words, pass_fds=(write,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as told:
        return server, int(told.readline())


def _port(profile: Path) -> int:
    """Where it listens; it writes that into its preferences."""
    deadline = time.monotonic() + SECONDS
    while time.monotonic() < deadline:
        for name in ("MarionetteActivePort", "prefs.js"):
            file = profile / name
            text = file.read_text(errors="replace") if file.exists() else ""
            match = (
                re.search(r'marionette\.port", (\d+)', text) if name == "prefs.js" else re.match(r"\d+", text)
            )
            if match and int(match[match.lastindex or 0]):
                return int(match[match.lastindex or 0])
        time.sleep(0.2)
    raise AssertionError("Firefox does not say where it listens")
