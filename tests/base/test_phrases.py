"""Lists of phrases in text files."""

import pytest

from langflash_core.base.phrases import MOST_PHRASES, read_phrases
from langflash_core.errors import PromptError


def test_phrases_are_read_once_each_and_remarks_are_not(tmp_path):
    path = tmp_path / "phrases.txt"
    path.write_bytes("\ufeffchair\r\n  plant pot \n\n# table\nchair\n".encode())
    assert read_phrases(path) == ["chair", "plant pot"]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "holds 0 phrases"),
        (b"# all of it\n", "holds 0 phrases"),
        (b"\xff\xfe\x00", "no text in UTF-8"),
        ("\n".join(map(str, range(MOST_PHRASES + 1))).encode(), f"holds {MOST_PHRASES + 1}"),
    ],
)
def test_what_is_no_list_is_one_sentence(tmp_path, content, said):
    path = tmp_path / "phrases.txt"
    path.write_bytes(content)
    with pytest.raises(PromptError, match=said):
        read_phrases(path)


def test_a_list_at_the_limit_is_read_and_one_past_it_is_not(tmp_path, monkeypatch):
    path = tmp_path / "phrases.txt"
    path.write_text("chair\n")
    monkeypatch.setenv("LANGFLASH_MOST_TEXT", "6")
    assert read_phrases(path) == ["chair"]
    path.write_text("chairs\n")
    with pytest.raises(PromptError, match="LANGFLASH_MOST_TEXT"):
        read_phrases(path)
    with pytest.raises(PromptError, match="no list of phrases"):
        read_phrases(tmp_path / "gone.txt")
