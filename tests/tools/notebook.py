"""A scene in a real JupyterLab in a real browser: a cell runs, camera and answers come back to Python.

python -m tests.tools.notebook [PICTURE.png]

Needs jupyterlab, ipykernel and anywidget beside the package, and Chromium. The browser's network is cut off
but for this machine.
"""

import io
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

from langflash_core.language.spaces import language_space
from langflash_core.scene.file import save
from tests.app.window.scenes import PHRASES, room
from tests.export import browser as chromium
from tests.export.browser import Browser

SIZE = (1280, 900)
HERE = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"
_FRAME = "document.querySelector('iframe[title=\"a scene\"]')"
_LISTEN = "heard = [], addEventListener('message', ({ data }) => heard.push(data?.langflash)), 0"
CELLS = (
    "import json\nimport langflash_core as lf\nscene = lf.load('room.langflash')\n"
    "shown = scene.show(['armchair', 'piano'], height=420)\nshown",
    "found = lf.query(scene, 'armchair', camera=shown.view()).answers[0].found\n"
    "open('told.json', 'w').write(json.dumps([shown.camera, shown.answers, found]))\n"
    "shown.asked = 'wall'",
    "open('asked.json', 'w').write(json.dumps(shown.answers))\nshown.go = {'view': 1}",
    "open('went.json', 'w').write(json.dumps(shown.camera))",
)


def notebook() -> dict:
    """Cells that show a scene, and write down what came back."""
    cells = [
        {
            "cell_type": "code",
            "id": f"c{n}",
            "metadata": {},
            "outputs": [],
            "execution_count": None,
            "source": s,
        }
        for n, s in enumerate(CELLS)
    ]
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    return {"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}


def main(picture: str | None = None) -> None:
    """Run it, and say what came back."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        save(room(language_space("minilm").encode(PHRASES)), place / "room.langflash")
        (place / "show.ipynb").write_text(json.dumps(notebook()))
        port = _free_port()
        words = (
            "--no-browser", "--allow-root", f"--port={port}", f"--ServerApp.root_dir={folder}",
            "--IdentityProvider.token=", "--ServerApp.disable_check_xsrf=True",
        )  # fmt: skip
        server = subprocess.Popen(
            [sys.executable, "-m", "jupyterlab", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "JUPYTER_PREFER_ENV_PATH": "1"},
        )
        try:
            _until_up(port)
            for name, value in _walk(place, port, picture).items():
                sys.stdout.write(f"{name}: {json.dumps(value)}\n")
        finally:
            server.terminate()
            server.wait(20)


def _walk(place: Path, port: int, picture: str | None) -> dict:
    with chromium.browser(place / "profile", HERE) as page:
        speeds = {"latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
        page.call("Network.emulateNetworkConditions", offline=False, **speeds)
        screen = {"width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": False}
        page.call("Emulation.setDeviceMetricsOverride", **screen)
        page.call("Page.navigate", url=f"http://127.0.0.1:{port}/lab/tree/show.ipynb")
        _until(page, "document.querySelectorAll('.jp-Notebook .jp-CodeCell').length === 4", 240)
        idle = "(each) => each.dataset.status === 'idle'"
        _until(page, f"[...document.querySelectorAll('.jp-Notebook-ExecutionIndicator')].some({idle})", 240)
        page.value(_LISTEN)
        _run_cell(page, 0)
        _until(page, f"{_FRAME} !== null", 240)
        _until(page, "heard.includes('answers') && heard.includes('camera')", 240)
        time.sleep(2)  # the kernel is told, too
        _run_cell(page, 1)
        told = _written(place / "told.json")
        _until(page, "heard.filter((word) => word === 'answers').length > 1", 120)
        time.sleep(2)
        if picture:
            page.value(f"{_FRAME}.scrollIntoView()")
            time.sleep(1)
            Path(picture).write_bytes(page.screenshot())
        _run_cell(page, 2)
        asked = _written(place / "asked.json")
        _until(page, "heard.filter((word) => word === 'answers').length > 2", 120)
        time.sleep(2)
        _run_cell(page, 3)
        went = _written(place / "went.json")
        return {"camera": told[0], "answers": told[1], "found": told[2], "after asking": asked, "went": went}


def _run_cell(page: Browser, number: int) -> None:
    """Choose a cell by its number, and press Shift and Enter until it runs."""
    prompt = f"document.querySelectorAll('.jp-CodeCell')[{number}].querySelector('.jp-InputPrompt')"
    while page.value(f"{prompt}.textContent") == "[ ]:":
        page.value(f"{prompt}.scrollIntoView({{block: 'center'}})")
        x, y = page.value(f"(({{x, y}}) => [x + 8, y + 8])({prompt}.getBoundingClientRect())")
        for kind in ("mousePressed", "mouseReleased"):
            page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
        for kind in ("keyDown", "keyUp"):
            held = {"key": "Enter", "code": "Enter", "modifiers": 8, "windowsVirtualKeyCode": 13}
            page.call("Input.dispatchKeyEvent", type=kind, **held)
        time.sleep(4)


def _written(path: Path, seconds: float = 60) -> list:
    deadline = time.monotonic() + seconds
    while not path.exists() or not path.read_text():
        assert time.monotonic() < deadline, f"{path.name} was not written"
        time.sleep(0.2)
    return json.loads(path.read_text())


def _until(page: Browser, expression: str, seconds: float = 90) -> None:
    deadline = time.monotonic() + seconds
    while not page.value(expression):
        assert time.monotonic() < deadline, f"never true: {expression}"
        time.sleep(0.3)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def _until_up(port: int) -> None:
    deadline = time.monotonic() + 90
    while True:
        try:
            urllib.request.urlopen(f"http://127.0.0.1:{port}/api", timeout=2).read(io.DEFAULT_BUFFER_SIZE)
            return
        except OSError:
            assert time.monotonic() < deadline, "JupyterLab does not start"
            time.sleep(0.3)


if __name__ == "__main__":
    main(*sys.argv[1:])
