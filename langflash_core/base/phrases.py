"""Lists of phrases in text files; read without torch."""

from pathlib import Path

from langflash_core.base.files import readable_file
from langflash_core.base.limits import TEXT
from langflash_core.errors import PromptError

MOST_PHRASES = 500


def read_phrases(path: Path) -> list[str]:
    """Phrases of a text file, one a line; empty lines and those that begin with # say nothing.

    Raises:
        PromptError: the file cannot be read, is too large, or holds no phrase or too many.
    """
    readable_file(path, "list of phrases", PromptError)
    TEXT.check(path.stat().st_size, path.name, PromptError)
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PromptError(f"{path.name} is no text in UTF-8; save the phrases as plain text") from error
    lines = [line.strip() for line in text.splitlines()]
    phrases = list(dict.fromkeys(line for line in lines if line and not line.startswith("#")))
    if not 1 <= len(phrases) <= MOST_PHRASES:
        raise PromptError(f"{path.name} holds {len(phrases)} phrases; write 1 to {MOST_PHRASES}, one a line")
    return phrases
