import pytest

from app.bench import Case, synthetic_case


def small_case() -> Case:
    """A generated room of a few hundred Gaussians, two frames."""
    return synthetic_case(400, 30, (64, 48), 2)


@pytest.fixture(scope="session")
def case() -> Case:
    return small_case()


def silent(stage: str, share: float) -> None:
    assert stage and 0 <= share <= 1
