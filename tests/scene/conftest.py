"""One thread: these tensors are small, and several test processes share the machine."""

import pytest

from tests.torch_threads import torch_threads


@pytest.fixture(autouse=True)
def one_thread():
    with torch_threads(1):
        yield
