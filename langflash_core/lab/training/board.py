"""TensorBoard's logs of a run, where its package is installed."""

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from langflash_core.base.optional import optional_packages


class Board:
    """Numbers of a run by step; one that is not wanted takes them and shows nothing."""

    def __init__(self, folder: Path, *, wanted: bool):
        """Raises:
        MissingPackageError: TensorBoard is not installed.
        """
        self._writer: Any = None
        if wanted:
            with optional_packages():
                from torch.utils.tensorboard import SummaryWriter
            self._writer = SummaryWriter(str(folder))

    def __enter__(self) -> "Board":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._writer is not None:
            self._writer.close()

    def show(self, group: str, numbers: Mapping[str, Any], step: int) -> None:
        """Every number among `numbers` as `group/name`."""
        if self._writer is None:
            return
        for name, value in numbers.items():
            if isinstance(value, int | float):
                self._writer.add_scalar(f"{group}/{name}", value, step)
        self._writer.flush()
