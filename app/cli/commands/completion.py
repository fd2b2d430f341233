"""`langflash completion`: scripts by which bash, zsh and fish complete it, made of the parser, so they know
what it knows.

A *path* is the words that lead to a command ("", "export", "tour stop").
"""

import argparse
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TextIO

from ..parser import build_parser

_BASH = """\
# langflash, for bash; in zsh bashcompinit runs it. Made by `langflash completion`.
_langflash() {
    local word="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}" way="" words="" at
    for ((at = 1; at < COMP_CWORD; at++)); do
        case "$way/${COMP_WORDS[at]}" in
            PATHS) way="${way:+$way }${COMP_WORDS[at]}" ;;
        esac
    done
    COMPREPLY=()
    case "$way/$before" in
CHOICES
    esac
    case "$way" in
WORDS
    esac
    case "$word" in
        -*) COMPREPLY=($(compgen -W "$words" -- "$word")) ;;
        *) case "$words" in [!-]*) COMPREPLY=($(compgen -W "${words%% -*}" -- "$word")) ;; esac ;;
    esac
}
complete -o default -F _langflash langflash
"""
_ZSH = """\
#compdef langflash
autoload -U +X compinit bashcompinit
(( $+functions[compdef] )) || compinit -u
bashcompinit
"""


@dataclass(frozen=True)
class Word:
    """One option, with what it says in help and the words that it takes."""

    names: tuple[str, ...]
    purpose: str
    choices: tuple[str, ...]
    takes: bool


@dataclass(frozen=True)
class Known:
    """What may stand behind a path: commands with their purposes, words of its own, and options."""

    path: str
    commands: dict[str, str]
    plain: tuple[str, ...]
    options: tuple[Word, ...]


def run(args: argparse.Namespace, out: TextIO) -> None:
    """Print it."""
    out.write(script(build_parser(), args.shell))


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """For "bash", "zsh" or "fish"."""
    known = tuple(_known(parser, ""))
    if shell == "fish":
        return "\n".join(("# langflash, for fish. Made by `langflash completion`.", *_fish(known), ""))
    return (_ZSH if shell == "zsh" else "") + _bash(known)


def _known(parser: argparse.ArgumentParser, path: str) -> Iterator[Known]:
    commands: dict[str, argparse.ArgumentParser] = {}
    purposes: dict[str, str] = {}
    plain: list[str] = []
    options: list[Word] = []
    for action in parser._actions:
        choices = tuple(map(str, action.choices or ()))
        if isinstance(action, argparse._SubParsersAction):
            commands |= action.choices
            purposes |= {choice.dest: _line(choice.help) for choice in action._choices_actions}
        elif action.option_strings:
            takes = action.nargs != 0
            options.append(Word(tuple(action.option_strings), _line(action.help), choices, takes))
        else:
            plain += choices
    yield Known(path, {name: purposes.get(name, "") for name in commands}, tuple(plain), tuple(options))
    for name, below in commands.items():
        yield from _known(below, f"{path} {name}".strip())


def _line(text: str | None) -> str:
    return " ".join((text or "").replace("%%", "%").split())


def _bash(known: tuple[Known, ...]) -> str:
    paths, choices, words = [], [], []
    for each in known:
        paths += [f'"{each.path}/{name}"' for name in each.commands]
        own = [*each.commands, *each.plain, *(name for option in each.options for name in option.names)]
        words.append(f'        "{each.path}") words="{" ".join(own)}" ;;')
        for option in each.options:
            if option.choices:
                said = "|".join(f'"{each.path}/{name}"' for name in option.names)
                fitting = f'COMPREPLY=($(compgen -W "{" ".join(option.choices)}" -- "$word")); return'
                choices.append(f"        {said}) {fitting} ;;")
    filled = {"PATHS": "|".join(paths), "CHOICES": "\n".join(choices), "WORDS": "\n".join(words)}
    return re.sub("PATHS|CHOICES|WORDS(?=\n)", lambda found: filled[found[0]], _BASH)


def _fish(known: tuple[Known, ...]) -> Iterator[str]:
    for each in known:
        seen = [f"__fish_seen_subcommand_from {word}" for word in each.path.split()]
        unseen = [f"not __fish_seen_subcommand_from {' '.join(each.commands)}"] if each.commands else []
        begin = f"complete -c langflash -n {_quoted('; and '.join(seen + unseen) or 'true')}"
        for name, purpose in each.commands.items():
            yield f"{begin} -f -a {name} -d {_quoted(purpose)}"
        if each.plain:
            yield f"{begin} -f -a {_quoted(' '.join(each.plain))}"
        for option in each.options:
            names = (f"-l {n[2:]}" if n.startswith("--") else f"-s {n[1:]}" for n in option.names)
            takes = f" -x -a {_quoted(' '.join(option.choices))}" if option.choices else " -r" * option.takes
            yield f"{begin} {' '.join(names)}{takes} -d {_quoted(option.purpose)}"


def _quoted(text: str) -> str:
    """For fish."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
