"""What a row of the torture says: what was done, what came of it, and what is wrong."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field


@dataclass
class Row:
    """name: of what is done. told: what came of it. finds: what is wrong, each once."""

    name: str
    told: str = ""
    finds: list[str] = field(default_factory=list)

    def find(self, words: str) -> None:
        """Something is wrong."""
        if words not in self.finds:
            self.finds.append(words)


@dataclass
class Counted(Row):
    """count: how often it was done. inside: how often while the work was under way."""

    count: int = 0
    inside: int = 0

    def done(self, inside: bool = True) -> None:
        """Once more."""
        self.count, self.inside = self.count + 1, self.inside + inside
        self.told = f"{self.count:,} times, {self.inside:,} of them at work"


def report(rows: Iterator[Row], say: Callable[[str], object]) -> int:
    """A line a row, and its finds below; how many finds."""
    finds = 0
    for row in rows:
        say(f"{row.name:36}{row.told}\n")
        for words in row.finds[:12]:
            say(f"    {words[:300]}\n")
        finds += len(row.finds)
    say(f"{finds} finds\n")
    return finds
