"""What every test shares."""

import os
import random
import re
import socket
import sys
from collections import Counter
from collections.abc import Generator
from pathlib import Path
from typing import Any

import jaxtyping
from jaxtyping import install_import_hook

# One thread a process, also in the processes that tests start: the tests' arrays are small, and
# on a busy machine threads that wait for each other cost up to fifty times what they save.
os.environ.setdefault("OMP_NUM_THREADS", "1")

# The processes that tests start run the checkout that the tests lie in, whatever is installed; and where
# products are moved here (tests/moved), then theirs, too.
ROOT = str(Path(__file__).resolve().parent.parent)
MOVED = [str(Path(__file__).resolve().parent / "moved")] if os.environ.get("LANGFLASH_MOVED") else []
os.environ["PYTHONPATH"] = os.pathsep.join([*MOVED, ROOT, *filter(None, [os.environ.get("PYTHONPATH")])])

# Every signature of the library holds at every call: shapes, their shared sizes, and types. An int
# passes for a float, as type checkers have it.
import pyrr  # noqa: E402, F401 - before the hook, which would compile it anew, and its docstrings warn

install_import_hook("langflash_core", "beartype.beartype(conf=beartype.BeartypeConf(is_pep484_tower=True))")

import pytest  # noqa: E402 - after the hook
import torch  # noqa: E402 - after the threads

torch.set_num_threads(int(os.environ["OMP_NUM_THREADS"]))

if MOVED:
    from tests.moved.arrays import move_arrays
    from tests.moved.products import move_products

    move_arrays()
    move_products()

_MISSING = re.compile(r"could not import .(?!sam2\b)|is not installed")
# sam2 is Meta's own package, of which there is no wheel.


def pytest_addoption(parser: pytest.Parser) -> None:
    told = "fail where an optional package is missing, instead of leaving its tests out"
    parser.addoption("--nothing-missing", action="store_true", help=told)


def _missing_fails(report: Any, config: pytest.Config) -> Any:
    """The report of a test or a module; with `--nothing-missing` one without its package has failed."""
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else ""
    if config.getoption("nothing_missing") and report.skipped and _MISSING.search(reason):
        report.outcome, report.longrepr = "failed", reason
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, Any, Any]:
    return _missing_fails((yield), item.config)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Generator[None, Any, Any]:
    return _missing_fails((yield), collector.config)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files of few tests first: they are the long ones, windows and training, and no process should begin
    one of them when the others are nearly done. What shuffles does so afterwards."""
    counts = Counter(item.path for item in items)
    items.sort(key=lambda item: counts[item.path])


def pytest_runtest_setup() -> None:
    """Of a list the checker looks at one item, drawn at random: the same one whenever a test is run again."""
    random.seed(0)


@pytest.fixture(scope="module", autouse=True)
def _as_many_threads() -> Generator[None, None, None]:
    """A command may set how many threads its process has; in the next module it would give other bits."""
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


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
    from langflash_core.base.graphics import offscreen_context
    from langflash_core.errors import GraphicsError

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
