"""What the program says of itself: bare `langflash` and `langflash --help`."""

import re
import shlex
from argparse import Namespace

import pytest

from app.cli.commands.export import request_of
from app.cli.overview import FIRST_DAY, GROUPS
from app.cli.parser import COMMANDS, build_parser

COLUMNS = 80  # of a terminal as it opens


def test_alone_it_shows_the_commands_of_a_first_day(done):
    outcome = done()
    assert not outcome.err
    lines = outcome.out.splitlines()
    examples = [line for line in lines if line.startswith("  langflash ")]
    assert [line.split()[1] for line in examples] == ["reconstruct", "view", "query", "render", "export"]
    assert max(map(len, lines)) <= COLUMNS and "--help" in lines[-1]


@pytest.mark.parametrize("words", FIRST_DAY)
def test_every_example_is_understood(words):
    args = build_parser().parse_args(shlex.split(words))
    assert isinstance(args, Namespace)
    if args.command == "export":
        request_of(args).check()


def test_every_command_has_one_heading():
    named = [name for names in GROUPS.values() for name in names]
    assert sorted(named) == sorted(COMMANDS)


@pytest.mark.parametrize("columns", [30, COLUMNS, 200])
def test_help_lists_commands_in_groups(done, monkeypatch, columns):
    """However wide the terminal is; a command with its purpose, below its heading."""
    monkeypatch.setenv("COLUMNS", str(columns))
    outcome = done("--help")
    said = re.split(r"^(\S.*):$", outcome.out, flags=re.MULTILINE)
    blocks = dict(zip(said[1::2], said[2::2], strict=True))
    assert list(blocks) == [*GROUPS, "options"]
    for heading, names in GROUPS.items():
        assert tuple(re.findall(r"^  ([a-z-]+)  +\S", blocks[heading], re.MULTILINE)) == names
    if columns == COLUMNS:
        assert max(map(len, outcome.out.splitlines())) <= columns
