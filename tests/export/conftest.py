"""A browser for all tests of a module; none of their pages may complain."""

import pytest

from tests.export.browser import browser


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("browser") / "profile") as opened:
        yield opened


@pytest.fixture
def page(chromium):
    yield chromium
    assert chromium.errors == []
