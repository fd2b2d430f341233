"""Completion: each shell's script knows what the parser knows, asked of the shells that are here."""

import shutil
import subprocess

import pytest

from app.cli.commands.completion import script
from app.cli.parser import build_parser

LINES = (
    (("tour", "st"), {"stop", "start"}),
    (("export", "a.langflash", "--what", "in"), {"instances", "inventory"}),
    (("weights", "get", "--k"), {"--keep"}),
    (("completion", ""), {"bash", "zsh", "fish"}),
    (("rec",), {"reconstruct"}),
)


def test_bash_completes(tmp_path):
    file = tmp_path / "completion"
    file.write_text(script(build_parser(), "bash"))
    ask = "\n".join(
        f"COMP_WORDS=(langflash {' '.join(repr(w) for w in words)}); COMP_CWORD={len(words)}; _langflash; "
        'echo "${COMPREPLY[*]}"'
        for words, _ in LINES
    )
    done = subprocess.run(
        ["bash", "--norc", "-ec", f"source {file}\n{ask}"], capture_output=True, text=True, timeout=30
    )
    assert not done.stderr
    assert [set(line.split()) for line in done.stdout.splitlines()] == [found for _, found in LINES]


@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish here")
def test_fish_completes(tmp_path):
    file = tmp_path / "completion.fish"
    file.write_text(script(build_parser(), "fish"))
    for words, found in LINES:
        line = f"source {file}; complete -C 'langflash {' '.join(words)}'"
        done = subprocess.run(["fish", "--no-config", "-c", line], capture_output=True, text=True, timeout=30)
        assert {entry.split("\t")[0] for entry in done.stdout.splitlines()} == found


def test_every_shell_gets_every_command(run, done):
    for shell in ("bash", "zsh", "fish"):
        outcome = done("completion", shell)
        assert "reconstruct" in outcome.out and "colormap" in outcome.out
    assert run("completion", "dos").code == 2
