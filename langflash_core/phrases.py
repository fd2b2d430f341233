"""Lists of phrases in text files; read without torch."""

from pathlib import Path

from langflash_core.errors import PromptError


def read_phrases(path: Path, most_bytes: int = 1 << 20, most: int = 500) -> list[str]:
    """Phrases of a text file, one a line; empty lines and those that begin with # say nothing.

    Raises:
        PromptError: the file cannot be read, or holds no phrase or too many.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(most_bytes + 1)
        text = content.decode("utf-8-sig")
    except OSError as error:
        reason = error.strerror or str(error)
        raise PromptError(f"the phrases {path} cannot be read ({reason}); check the path") from error
    except UnicodeDecodeError as error:
        raise PromptError(f"{path.name} is no text in UTF-8; save the phrases as plain text") from error
    lines = [line.strip() for line in text.splitlines()]
    phrases = list(dict.fromkeys(line for line in lines if line and not line.startswith("#")))
    if not 1 <= len(phrases) <= most or len(content) > most_bytes:
        raise PromptError(f"{path.name} holds {len(phrases)} phrases; write 1 to {most}, one a line")
    return phrases
