"""The lab's commands are run as the product's are."""

from tests.app.cli.conftest import run, scene_file  # noqa: F401 - fixtures
