"""What every test shares."""

import os
import random
import socket
import sys
from pathlib import Path

import jaxtyping
from jaxtyping import install_import_hook

# One thread a process, also in the processes that tests start: the tests' arrays are small, and
# on a busy machine threads that wait for each other cost up to fifty times what they save.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# The processes that tests start run the checkout that the tests lie in, whatever is installed.
ROOT = str(Path(__file__).resolve().parent.parent)
os.environ["PYTHONPATH"] = os.pathsep.join([ROOT, *filter(None, [os.environ.get("PYTHONPATH")])])

# Every signature of the library holds at every call: shapes, their shared sizes, and types. An int
# passes for a float, as type checkers have it.
import pyrr  # noqa: E402, F401 - before the hook, which would compile it anew, and its docstrings warn

install_import_hook("langflash_core", "beartype.beartype(conf=beartype.BeartypeConf(is_pep484_tower=True))")

import pytest  # noqa: E402 - after the hook
import torch  # noqa: E402 - after the threads

torch.set_num_threads(int(os.environ["OMP_NUM_THREADS"]))


def pytest_runtest_setup() -> None:
    """Of a list the checker looks at one item, drawn at random: the same one whenever a test is run again."""
    random.seed(0)


_NEAR = ("127.", "::1", "localhost", "0.0.0.0")  # this computer


def _keep_near(event: str, arguments: tuple) -> None:
    """No test reaches the network: what one would fetch, it makes itself and serves on this computer."""
    if event == "socket.getaddrinfo":
        host = arguments[0]
    elif event in ("socket.connect", "socket.sendto") and isinstance(arguments[1], tuple):
        host = arguments[1][0]
    else:
        return
    host = host.decode() if isinstance(host, bytes) else host
    if host and not str(host).startswith((*_NEAR, socket.gethostname())):
        raise RuntimeError(f"a test tried to reach {host}")


sys.addaudithook(_keep_near)


@pytest.fixture
def unchecked(monkeypatch):
    """What the product itself says of shapes that it cannot take, which the checker would refuse before."""
    monkeypatch.setattr(jaxtyping.config, "jaxtyping_disable", True)


@pytest.fixture(scope="session")
def context():
    """One OpenGL context without a window for all tests; they are skipped where there is none."""
    from langflash_core.errors import GraphicsError
    from langflash_core.graphics import offscreen_context

    try:
        made = offscreen_context()
    except GraphicsError as problem:
        pytest.skip(str(problem))
    yield made
    made.release()


@pytest.fixture
def gl(context):
    """The context, free of errors before and after each test; current, whoever else drew in between."""
    context.__enter__()
    assert context.error == "GL_NO_ERROR"
    yield context
    assert context.error == "GL_NO_ERROR"
