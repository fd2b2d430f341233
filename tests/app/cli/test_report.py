import io
import json

import pytest

from app.cli.report import ProgressBar, say_error, write_json


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_bar_on_a_terminal():
    stream = Terminal()
    with ProgressBar(stream) as progress:
        progress("a long stage name", 0.5)
        progress("short", 2.0)  # more than all is drawn as all
    first, second, wiped, after = stream.getvalue().split("\r")[1:]
    assert "#" * 15 + "." * 15 in first and first.endswith("a long stage name")
    assert "#" * 30 in second and len(second) == len(first)  # covers what stood there
    assert wiped.strip() == "" and after == ""


def test_bar_goes_away_after_an_error():
    stream = Terminal()
    with pytest.raises(ValueError, match="no"), ProgressBar(stream) as progress:
        progress("stage", 0.1)
        raise ValueError("no")
    assert stream.getvalue().endswith(" \r")


def test_no_bar_elsewhere():
    stream = io.StringIO()
    with ProgressBar(stream) as progress:
        progress("stage", 0.5)
    assert stream.getvalue() == ""


def test_errors_stay_on_one_line(capsys):
    say_error("first line\n  second line")
    assert capsys.readouterr().err == "langflash: first line second line\n"


def test_json_is_ascii_and_finite():
    stream = io.StringIO()
    write_json({"prompt": "椅子", "score": 0.5}, stream)
    assert stream.getvalue().isascii()
    assert json.loads(stream.getvalue()) == {"prompt": "椅子", "score": 0.5}
    with pytest.raises(ValueError, match="JSON"):
        write_json({"score": float("nan")}, io.StringIO())
