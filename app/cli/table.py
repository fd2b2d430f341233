"""How far a run over many sets or clips is: a table that is drawn again and again on a terminal, else a line
each."""

import shutil
import sys
import time
from collections.abc import Sequence
from typing import TextIO

from langflash_core.batch.dispatch import Workers
from langflash_core.batch.ledger import FAILED, Row

from .report import one_sentence

_AGAIN = 0.2  # seconds between two drawings
_LAST = 3  # failures shown


class ProgressTable:
    """What is done and under way, on stderr; as a context manager it leaves a clean screen behind."""

    def __init__(self, total: int, workers: Workers, item: str = "set", stream: TextIO | None = None) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.live = self.stream.isatty()
        self._total, self._workers, self._item = total, workers, item
        self._ended = self._failed = 0
        self._notes: list[str] = []
        self._begun: dict[str, float] = {}
        self._start, self._drawn_at = time.monotonic(), 0.0
        self._lines = 0  # on the screen now

    def told(self, row: Row) -> None:
        """One has ended."""
        self._ended += 1
        self._begun.pop(row.name, None)
        line = f"{row.name}: {row.status}"
        line += f", {one_sentence(row.reason)}" if row.status == FAILED else f", {row.seconds:.1f} s"
        if row.status == FAILED:
            self._failed += 1
            self._notes = [*self._notes, line][-_LAST:]
        if not self.live:
            print(f"[{self._ended}/{self._total}] {line}", file=self.stream, flush=True)

    def tick(self) -> None:
        """Draw again, if it is time to."""
        now = time.monotonic()
        if not self.live or now - self._drawn_at < _AGAIN:
            return
        self._drawn_at = now
        busy = [job.name for job in self._workers.busy]
        self._begun = {name: self._begun.get(name, now) for name in busy}
        under_way = [f"  {name}  {now - begun:.0f} s" for name, begun in self._begun.items()]
        self._draw([self._headline(now), *under_way, *(f"  {note}" for note in self._notes)])

    def _headline(self, now: float) -> str:
        line = f"{self._ended}/{self._total} {self._item}s"
        if self._failed:
            line += f", {self._failed} failed"
        if self._ended:
            rate = self._ended / (now - self._start)
            line += f", {60 * rate:.1f} a minute, {_clock((self._total - self._ended) / rate)} to go"
        return line

    def _draw(self, lines: Sequence[str]) -> None:
        """In place of what was drawn before; never more than the screen holds."""
        width, height = shutil.get_terminal_size()
        shown = [line[: width - 1] for line in lines[: height - 1]]
        up = f"\x1b[{self._lines}A" if self._lines else ""
        self.stream.write(up + "\r\x1b[J" + "".join(f"{line}\n" for line in shown))
        self.stream.flush()
        self._lines = len(shown)

    def __enter__(self) -> "ProgressTable":
        return self

    def __exit__(self, *_: object) -> None:
        if self.live:
            self._draw([])


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}" if minutes >= 60 else f"{minutes}:{rest:02d}"
