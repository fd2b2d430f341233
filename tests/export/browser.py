"""A headless Chromium that tests drive through a pipe, cut off from every network.

The protocol is Chrome DevTools': JSON messages, each ended by a zero byte, on the file descriptors 3
and 4 of the browser. OpenGL is drawn in software.
"""

import base64
import fcntl
import itertools
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

SECONDS = 120  # that an answer may take
NAMES = ("chromium", "chromium-browser", "google-chrome")
SWITCHES = (
    "--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--disable-dev-shm-usage", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-extensions",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--proxy-server=127.0.0.1:9", "--mute-audio",
)  # fmt: skip


def program() -> str | None:
    """The browser's path, where there is one that this driver can talk to."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    return found if sys.platform.startswith("linux") else None


needs_browser = pytest.mark.skipif(program() is None, reason="no Chromium here; apt-get install chromium")


class Browser:
    """One page. `requests` are the addresses that it asked for, `errors` what it complained of."""

    def __init__(self, sending: int, receiving: int):
        self.requests: list[str] = []
        self.errors: list[str] = []
        self._sending, self._receiving = sending, receiving
        self._left = b""
        self._numbers = itertools.count(1)
        self._session: str | None = None

    def attach(self) -> None:
        """Talk to the page from now on."""
        targets = self.call("Target.getTargets")["targetInfos"]
        page = next(target["targetId"] for target in targets if target["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setFocusEmulationEnabled", enabled=True)  # else no element tells of it
        self.call(
            "Network.emulateNetworkConditions",
            offline=True,
            latency=0,
            downloadThroughput=0,
            uploadThroughput=0,
        )

    def call(self, method: str, **params: Any) -> dict:
        """The result of a call; what happens meanwhile is noted."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._sending, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + SECONDS
        while True:
            answer = self._received(deadline, method)
            if answer.get("id") == number:
                assert "error" not in answer, answer["error"]
                return answer["result"]
            self._note(answer)

    def open(self, path: Path, size: tuple[int, int], fragment: str = "", touch: bool = False) -> None:
        """Show a page of a size in pixels and wait until it has drawn."""
        self.requests.clear()
        self.errors.clear()
        width, height = size
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=touch,
        )
        self.call("Emulation.setTouchEmulationEnabled", enabled=touch)
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=path.resolve().as_uri() + fragment)
        self.value("new Promise((done) => (document.readyState === 'complete' ? done() : (onload = done)))")

    def show(self, path: Path, size: tuple[int, int], fragment: str = "", touch: bool = False) -> None:
        """Open a page of a scene, and wait until its picture is there."""
        self.open(path, size, fragment, touch)
        self.value("langflash.then((page) => { page.drawing.read(page.target, 0); return 0; })")

    def value(self, expression: str) -> Any:
        """What an expression gives, after its promise, as JSON."""
        result = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True, userGesture=True
        )
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def screenshot(self) -> bytes:
        """The page as a PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def key(self, name: str, code: str = "", text: str = "") -> None:
        """Press and let go."""
        for kind in ("keyDown", "keyUp"):
            words = {"text": text} if text and kind == "keyDown" else {}
            self.call("Input.dispatchKeyEvent", type=kind, key=name, code=code or name, **words)

    def type(self, text: str) -> None:
        """Into what has the focus."""
        for letter in text:
            self.key(letter, text=letter)

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """With the left button."""
        steps = (("mousePressed", start), ("mouseMoved", end), ("mouseReleased", end))
        for kind, (x, y) in steps:
            held = {"button": "left", "buttons": 0 if kind == "mouseReleased" else 1, "clickCount": 1}
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **held)

    def touch(self, *moments: list[tuple[int, int]]) -> None:
        """Fingers at places, moment by moment."""
        for index, fingers in enumerate(moments):
            points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(fingers)]
            self.call(
                "Input.dispatchTouchEvent", type="touchMove" if index else "touchStart", touchPoints=points
            )
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def _received(self, deadline: float, waiting_for: str) -> dict:
        while b"\0" not in self._left:
            ready, _, _ = select.select([self._receiving], [], [], max(0, deadline - time.monotonic()))
            assert ready, f"the browser does not answer {waiting_for}"
            part = os.read(self._receiving, 1 << 20)
            assert part, "the browser is gone"
            self._left += part
        message, _, self._left = self._left.partition(b"\0")
        return json.loads(message)

    def _note(self, event: dict) -> None:
        what, params = event.get("method"), event.get("params", {})
        if what == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        elif what == "Runtime.exceptionThrown":
            self.errors.append(params["exceptionDetails"].get("exception", {}).get("description", "?"))
        elif what == "Log.entryAdded" and params["entry"]["level"] == "error":
            self.errors.append(params["entry"]["text"])


@contextmanager
def browser(profile: Path, *more: str) -> Iterator[Browser]:
    """A browser with an empty profile in a folder, and more switches; ended with the block."""
    found = program()
    assert found is not None
    to_read, to_write = os.pipe()
    from_read, from_write = os.pipe()
    theirs = [fcntl.fcntl(fd, fcntl.F_DUPFD, 10) for fd in (to_read, from_write)]

    def place() -> None:
        for fd, wanted in zip(theirs, (3, 4), strict=True):
            os.dup2(fd, wanted)

    running = subprocess.Popen(
        [found, *SWITCHES, *more, f"--user-data-dir={profile}", "about:blank"],
        pass_fds=(3, 4), preexec_fn=place, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    for fd in (to_read, from_write, *theirs):
        os.close(fd)
    page = Browser(to_write, from_read)
    try:
        page.attach()
        yield page
    finally:
        os.close(to_write)  # the browser ends with its pipe
        try:
            running.wait(15)
        except subprocess.TimeoutExpired:
            running.kill()
            running.wait()
        os.close(from_read)
