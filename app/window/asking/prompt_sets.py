"""Prompt sets in small JSON files: phrases with colour, visibility and threshold, the language
vectors of those that ask for a place, and the negatives."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

from langflash_core.base.files import write_atomically
from langflash_core.errors import PromptError

from .state import PALETTE, Prompt

FORMAT, VERSION = "langflash prompts", 1
MOST_BYTES = 1 << 20
MOST_PROMPTS = 8
LONGEST = 500  # characters of a phrase


@dataclass(frozen=True)
class PromptSet:
    """Prompts, their keys meaning nothing, and what they are compared with."""

    prompts: tuple[Prompt, ...]
    negatives: tuple[str, ...]


def write_prompts(chosen: PromptSet, path: Path) -> None:
    """Write a set; whole or not at all.

    Raises:
        OutputError: the place cannot be written.
    """
    rows = [
        {
            "text": p.text,
            "colour": list(p.colour),
            "visible": p.visible,
            "threshold": p.threshold,
            **({"like": p.like.hex()} if p.like else {}),
        }
        for p in chosen.prompts
        if p.text.strip()
    ]
    document = {"format": FORMAT, "version": VERSION, "prompts": rows, "negatives": list(chosen.negatives)}
    text = json.dumps(document, indent=2, ensure_ascii=False) + "\n"
    write_atomically(path, text.encode("utf-8", "replace"))


def read_prompts(path: Path) -> PromptSet:
    """Read a set that `write_prompts` wrote, or one written by hand.

    Raises:
        PromptError: there is no such file, or it holds no usable set; says what is wrong.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except OSError as error:
        reason = error.strerror or str(error)
        raise PromptError(f"the prompt set {path} cannot be read ({reason}); choose another file") from error
    if len(content) > MOST_BYTES:
        raise PromptError(f"{path} is larger than a prompt set can be; choose another file")
    try:
        document = json.loads(content.decode("utf-8"))
        return _parsed(document)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        why = " ".join(str(error).split())[:120]
        message = f"{path.name} is no usable prompt set ({why}); save one from the window"
        raise PromptError(message) from error


def _parsed(document: dict) -> PromptSet:
    if document["format"] != FORMAT or document["version"] != VERSION:
        raise ValueError(f"expected format {FORMAT!r}, version {VERSION}")
    rows, negatives = document["prompts"], document["negatives"]
    if not 1 <= len(rows) <= MOST_PROMPTS:
        raise ValueError(f"expected 1 to {MOST_PROMPTS} prompts, found {len(rows)}")
    prompts = tuple(_prompt(row, place) for place, row in enumerate(rows))
    return PromptSet(prompts, tuple(_phrase(text) for text in negatives))


def _prompt(row: dict, place: int) -> Prompt:
    colour = row.get("colour", PALETTE[place])
    red, green, blue = (_number(value) for value in colour)
    threshold, like = row.get("threshold"), bytes.fromhex(row.get("like", ""))
    if len(like) % 4:
        raise ValueError("expected whole numbers of a language vector")
    return Prompt(
        key=place,
        text=_phrase(row["text"]),
        colour=(red, green, blue),
        threshold=None if threshold is None else _number(threshold),
        visible=bool(row.get("visible", True)),
        like=like,
    )


def _phrase(text: str) -> str:
    if not isinstance(text, str) or not text.strip() or len(text) > LONGEST:
        raise ValueError(f"expected a phrase of at most {LONGEST} characters, found {str(text)[:40]!r}")
    return " ".join(text.split())


def _number(value: float) -> float:
    number = float(value)
    if not (math.isfinite(number) and 0 <= number <= 1):
        raise ValueError(f"expected a number from 0 to 1, found {value}")
    return number
