"""What the documents at the top say of the tree is true, and the code cites no document that is not there."""

import argparse
import re
from pathlib import Path

import pytest
import yaml

from app.cli.parser import build_parser

ROOT = Path(__file__).resolve().parent.parent
DOCUMENTS = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md")
TOPS = ("app", "langflash_core", "shaders", "assets", "tests", ".github", ".ci")
TO_BE_MADE = re.compile(r"NAME")  # of recipes
SOURCES = ("*.py", "*.frag", "*.vert", "*.glsl")


def named_paths(text: str) -> set[str]:
    """Everything in `backquotes` that is a path from the top, and where [links](lead)."""
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    quoted = {word.rstrip("/") for word in re.findall(r"`([^`\s]+)`", prose)}
    paths = {word for word in quoted if word.split("/")[0] in TOPS and ("/" in word or word == "app")}
    files = {word for word in quoted if "/" not in word and (ROOT / word).suffix in (".md", ".toml")}
    links = set(re.findall(r"\]\(([^)#]+)\)", prose))
    return {path for path in paths | files | links if not TO_BE_MADE.search(path) and "://" not in path}


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_path_exists(document):
    paths = named_paths((ROOT / document).read_text(encoding="utf-8"))
    assert not {path for path in paths if not (ROOT / path).exists()}


def test_architecture_and_contributing_name_paths():
    """Else the test above would hold of an empty page."""
    for document in ("ARCHITECTURE.md", "CONTRIBUTING.md"):
        assert len(named_paths((ROOT / document).read_text(encoding="utf-8"))) >= 10


def test_every_folder_and_module_at_the_top_is_explained():
    told = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    for top in ("app", "langflash_core"):
        for path in (ROOT / top).iterdir():
            if path.is_dir() and path.name[0] not in "._":
                assert f"`{top}/{path.name}/`" in told
            elif path.suffix == ".py" and path.stem != "__init__" and top == "langflash_core":
                assert f"`{top}/{path.name}`" in told


def test_no_comment_cites_a_document_that_is_not_here():
    here = {path.name for path in ROOT.glob("*.md")} | {path.name for path in (ROOT / "assets").rglob("*.md")}
    here |= {path.name for path in (ROOT / "tests" / "fixtures").rglob("*.md")}
    for top in ("app", "langflash_core", "shaders", "tests"):
        for pattern in SOURCES:
            for path in (ROOT / top).rglob(pattern):
                text = path.read_text(encoding="utf-8")
                # Names in quotes are files that code writes.
                cited = set(re.findall(r'(?<!")\b[\w-]+\.md\b(?!")', text))
                assert cited <= here, f"{path.relative_to(ROOT)} cites {cited - here}"


def test_headings_that_are_cited_exist():
    headings = re.findall(r"^#+ (.+)$", (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8"), re.MULTILINE)
    for top in ("app", "langflash_core", "shaders"):
        for pattern in SOURCES:
            for path in (ROOT / top).rglob(pattern):
                for cited in re.findall(r'ARCHITECTURE\.md, "([^"]+)"', path.read_text(encoding="utf-8")):
                    assert cited in headings, f"{path.relative_to(ROOT)} cites {cited}"


def _commands(parser: argparse.ArgumentParser, name: str = "") -> dict[str, set[str]]:
    """Options of a command and of all below it, by the words that lead there."""
    found = {name: {option for action in parser._actions for option in action.option_strings}}
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, below in action.choices.items():
                found |= _commands(below, f"{name} {word}".strip())
    return found


@pytest.mark.parametrize("document", ["README.md", "CHANGELOG.md"])
def test_every_command_and_option_exists(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    known = _commands(build_parser())
    words = {name.split()[0] for name in known if name}
    groups = {name.split()[0] for name in known if " " in name}
    for first, second in re.findall(r"`langflash ([a-z-]+)(?: ([a-z][a-z-]+))?", text):
        assert first in words, f"there is no langflash {first}"
        if second and first in groups:
            assert f"{first} {second}" in known, f"there is no langflash {first} {second}"
    told = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text))
    assert told - set().union(*known.values()) <= {"--help"} and len(told) > 5


def test_hosted_checks_run_what_everybody_runs():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "checks.yml").read_text(encoding="utf-8"))["jobs"]
    assert "make test" in [step.get("run") for step in jobs["linux"]["steps"]]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0][
        "hooks"
    ]
    tools = {hook["entry"].split()[0].rpartition("/")[2] for hook in hooks}
    assert tools and all(f"$(BIN)/{tool}" in makefile for tool in tools)
