"""One thread: these tensors are small, and timings would depend on how many there are."""

import pytest

from tests.torch_threads import torch_threads


@pytest.fixture(autouse=True)
def one_thread():
    with torch_threads(1):
        yield
