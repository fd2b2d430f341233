"""A browser for all tests of a module."""

import pytest

from tests.export.browser import browser


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("browser") / "profile") as opened:
        yield opened
