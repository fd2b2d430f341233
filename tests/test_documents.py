"""What documents and docstrings say of the tree is true; pages are short enough; findings have dates."""

import argparse
import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
import yaml

from app.cli.parser import build_parser

ROOT = Path(__file__).resolve().parent.parent
CARD, HISTORY = "assets/weights/mini_card.md", "assets/weights/mini_history.md"
WORDS = {
    "README.md": 2_400,
    "GUIDE.md": 6_500,
    "LAB.md": 3_300,
    "ARCHITECTURE.md": 4_300,
    "CONTRIBUTING.md": 2_900,
    "CHANGELOG.md": 1_100,
    "MEASURED.md": 5_000,
    "SECURITY.md": 1_300,
    CARD: 1_600,
    HISTORY: 800,
}
"""What a page may grow to before something has to leave it. There is room, so that nobody shortens sentences
to stay within it; all pages at the top together have a limit of their own."""
ALL_WORDS = 24_500
"""What somebody who joins can read in two hours."""
LINE = 120
"""Letters of a line of prose: what an editor shows beside another."""
DOCUMENTS = tuple(WORDS)
TOPS = ("app", "langflash_core", "shaders", "assets", "tests", ".github", ".ci")
TO_BE_MADE = re.compile(r"NAME")  # of recipes
SOURCES = ("*.py", "*.frag", "*.vert", "*.comp", "*.glsl")
DOTTED = re.compile(r"(?<![\w./-])(?:langflash_core|app)(?:\.[A-Za-z_]\w*)+(?![\w/(]*/)")
# Options of everything, of pytest here, of torchrun, of Biome.
ELSEWHERE = {"--help", "--nothing-missing", "--nproc-per-node", "--write"}


def read(document: str) -> str:
    return (ROOT / document).read_text(encoding="utf-8")


def prose(text: str) -> str:
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


def named_paths(text: str) -> set[str]:
    """Everything in `backquotes` that is a path from the top."""
    quoted = {word.rstrip("/") for word in re.findall(r"`([^`\s]+)`", prose(text))}
    paths = {word for word in quoted if word.split("/")[0] in TOPS and ("/" in word or word == "app")}
    files = {word for word in quoted if "/" not in word and (ROOT / word).suffix in (".md", ".toml")}
    return {path for path in paths | files if not TO_BE_MADE.search(path)}


def links(text: str) -> set[str]:
    """Where [links](lead), from the document's own folder."""
    return {path for path in re.findall(r"\]\(([^)#\s]+)", prose(text)) if "://" not in path}


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_path_exists(document):
    text = read(document)
    assert not {path for path in named_paths(text) if not (ROOT / path).exists()}
    assert not {path for path in links(text) if not ((ROOT / document).parent / path).exists()}


def test_documents_that_tell_of_the_tree_name_paths():
    """Else the test above would hold of an empty page."""
    for document in ("ARCHITECTURE.md", "CONTRIBUTING.md", "LAB.md"):
        assert len(named_paths(read(document))) >= 10
    assert len(links(read("README.md"))) >= 15 and len(links(read("GUIDE.md"))) >= 5


def test_links_within_a_page_lead_to_a_heading():
    for document in DOCUMENTS:
        text = read(document)
        anchors = {re.sub(r"[^\w -]", "", name.lower()).replace(" ", "-") for name in headings(document)}
        assert set(re.findall(r"\]\(#([^)]+)\)", text)) <= anchors


@pytest.mark.parametrize("document", ["ARCHITECTURE.md", "LAB.md"])
def test_a_file_without_a_folder_lies_in_one_that_its_paragraph_names(document):
    items = re.split(r"\n\s*\n|\n(?=\d+\. |- |\| )", prose(read(document)))
    for item in items:
        quoted = re.findall(r"`([^`\s]+)`", item)
        folders = [ROOT / word for word in quoted if word.split("/")[0] in TOPS and (ROOT / word).is_dir()]
        for word in quoted:
            if re.fullmatch(r"[\w/]+\.(?:py|frag|vert|glsl)", word) and word.split("/")[0] not in TOPS:
                assert any((folder / word).exists() for folder in folders), f"{document}: {word}"


def test_every_folder_and_module_at_the_top_is_explained():
    told = read("ARCHITECTURE.md")
    for top in ("app", "langflash_core"):
        for path in (ROOT / top).iterdir():
            if path.is_dir() and path.name[0] not in "._":
                assert f"`{top}/{path.name}/`" in told
            elif path.suffix == ".py" and path.stem != "__init__" and top == "langflash_core":
                assert f"`{top}/{path.name}`" in told


@cache
def sources() -> tuple[tuple[Path, str], ...]:
    """Every file of code with its text."""
    paths = (path for top in ("app", "langflash_core", "shaders", "tests") for path in _below(ROOT / top))
    return tuple((path, path.read_text(encoding="utf-8")) for path in paths)


def _below(folder: Path) -> Iterator[Path]:
    for pattern in SOURCES:
        yield from sorted(folder.rglob(pattern))


def test_no_comment_cites_a_document_that_is_not_here():
    here = {path.name for path in ROOT.glob("*.md")} | {path.name for path in (ROOT / "assets").rglob("*.md")}
    here |= {path.name for path in (ROOT / "tests" / "fixtures").rglob("*.md")}
    for path, text in sources():
        # Names in quotes are files that code writes.
        cited = set(re.findall(r'(?<!")\b[\w-]+\.md\b(?!")', text))
        assert cited <= here, f"{path.relative_to(ROOT)} cites {cited - here}"


@cache
def headings(document: str) -> set[str]:
    return set(re.findall(r"^#+ (.+)$", prose(read(document)), re.MULTILINE))


def cited_headings(text: str) -> list[tuple[str, str]]:
    """Where a text names a page and, after a comma, one of its headings in quotes."""
    found = re.findall(r'([\w/]+\.md)`?,\s+"([^"]+)"', text)
    return [(document, " ".join(heading.split())) for document, heading in found]


def test_headings_that_are_cited_exist():
    cited = [
        (path.relative_to(ROOT).as_posix(), pair) for path, text in sources() for pair in cited_headings(text)
    ]
    cited = [(where, pair) for where, pair in cited if where != "tests/test_documents.py"]
    cited += [(document, pair) for document in DOCUMENTS for pair in cited_headings(read(document))]
    assert len(cited) >= 8
    for where, (document, heading) in cited:
        assert heading in headings(document), f'{where} cites {document}, "{heading}"'


# Names of code, resolved by reading and not by importing


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def _targets(node: ast.stmt) -> Iterator[ast.expr]:
    if isinstance(node, ast.Assign):
        yield from node.targets
    elif isinstance(node, ast.AnnAssign | ast.AugAssign):
        yield node.target


def defined(body: list[ast.stmt]) -> dict[str, ast.stmt]:
    """What a module or class defines, also under an `if` or a `try`."""
    found: dict[str, ast.stmt] = {}
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found[node.name] = node
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {alias.asname or alias.name.partition(".")[0]: node for alias in node.names}
        elif isinstance(node, ast.If | ast.Try):
            found |= defined(node.body) | defined(node.orelse)
        for target in _targets(node):
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            found |= {name.id: node for name in names if isinstance(name, ast.Name)}
    return found


@cache
def code() -> dict[Path, str]:
    """Modules of the program and the library."""
    tests = ROOT / "tests"
    return {path: text for path, text in sources() if path.suffix == ".py" and not path.is_relative_to(tests)}


@cache
def classes(name: str) -> tuple[ast.ClassDef, ...]:
    """All classes of that name; only modules that have one are parsed."""
    begins = re.compile(rf"^\s*class {name}\b", re.MULTILINE)
    trees = (tree_of(path) for path, text in code().items() if begins.search(text))
    nodes = (node for tree in trees for node in ast.walk(tree))
    return tuple(node for node in nodes if isinstance(node, ast.ClassDef) and node.name == name)


def has_attribute(owner: ast.ClassDef, name: str) -> bool:
    """Whether a class defines it, sets it on itself, or has it of a base; one from elsewhere may have it."""
    own = {node.attr for node in ast.walk(owner) if isinstance(node, ast.Attribute) and _of_self(node)}
    if name in own or name in defined(owner.body):
        return True
    for base in owner.bases:
        word = base.attr if isinstance(base, ast.Attribute) else getattr(base, "id", "")
        if not classes(word):
            return word not in ("Protocol", "Enum", "object")
        if any(has_attribute(other, name) for other in classes(word) if other is not owner):
            return True
    return False


def _of_self(node: ast.Attribute) -> bool:
    return isinstance(node.ctx, ast.Store) and getattr(node.value, "id", "") == "self"


def resolved(dotted: str) -> bool:
    """Whether a module, or what one defines, has this name."""
    place, words = ROOT, dotted.split(".")
    while words and (place / words[0]).is_dir():
        place, words = place / words[0], words[1:]
    module = place / "__init__.py"
    if words and (place / f"{words[0]}.py").exists():
        module, words = place / f"{words[0]}.py", words[1:]
    if not words:
        return True
    node = defined(tree_of(module).body).get(words[0]) if module.exists() else None
    if isinstance(node, ast.ClassDef) and len(words) == 2:
        return has_attribute(node, words[1])
    return node is not None and (len(words) == 1 or isinstance(node, ast.Import | ast.ImportFrom))


def docstrings(text: str) -> str:
    return "\n".join(re.findall(r'"""(.*?)"""', text, re.DOTALL))


def wrong_names(text: str) -> set[str]:
    """Dotted names of ours that nothing has: `langflash_core.x.y`, and `Class.attribute` of our classes."""
    wrong = {name for name in DOTTED.findall(text) if not name.endswith(".py") and not resolved(name)}
    for owner, name in re.findall(r"`([A-Z]\w+)\.([a-z_]\w*)(?:\(\))?`", text):
        if classes(owner) and not any(has_attribute(node, name) for node in classes(owner)):
            wrong.add(f"{owner}.{name}")
    return wrong


def test_names_are_resolved_without_importing():
    assert resolved("langflash_core.save") and resolved("langflash_core.scene.edits.Marks")
    assert resolved("langflash_core.scene.edits.Marks.there") and resolved("app.window.governor")
    assert not resolved("langflash_core.saved") and not resolved("langflash_core.scene.edit.Marks")
    assert not resolved("langflash_core.scene.edits.Marks.here")
    assert wrong_names("`Scene.levels`, `Scene.level` and langflash_core.nothing") == {
        "Scene.level",
        "langflash_core.nothing",
    }


@pytest.mark.parametrize("document", DOCUMENTS)
def test_names_of_code_in_documents_exist(document):
    assert not wrong_names(read(document))


def test_names_of_code_and_paths_in_docstrings_exist():
    wrong = {}
    for path, module in code().items():
        text = docstrings(module)
        cited = re.findall(
            r"(?<![\w/.])(?:app|langflash_core|shaders|tests)/[\w/-]+\.(?:py|frag|vert|glsl)", text
        )
        found = wrong_names(text) | {name for name in cited if not (ROOT / name).exists()}
        if found:
            wrong[path.relative_to(ROOT).as_posix()] = found
    assert not wrong


# Length, dates, commands


def words(text: str) -> list[str]:
    """All that has a letter or a digit: the lines of a table are no words."""
    return [word for word in text.split() if re.search(r"\w", word)]


@pytest.mark.parametrize("document", WORDS)
def test_a_page_is_as_long_as_one_reads(document):
    text = read(document)
    assert len(words(text)) <= WORDS[document], (
        f"{document} grew; say less, or move something to another page"
    )
    prose_lines = [line for line in prose(text).splitlines() if not line.startswith(("|", "![", "<!--"))]
    assert not [line for line in prose_lines if len(line) > LINE]


def test_lines_of_tables_are_no_words():
    assert words("| a | `b` |\n| --- | --- |\n- 1 % of c") == ["a", "`b`", "1", "of", "c"]


def test_all_pages_at_the_top_can_be_read_at_once():
    counts = {name: len(words(read(name))) for name in WORDS if "/" not in name}
    assert {path.name for path in ROOT.glob("*.md")} == set(counts)
    assert sum(counts.values()) <= ALL_WORDS, counts


def findings(text: str) -> Iterator[tuple[str, str]]:
    """Each line of a list, or what else stands below a heading, after what the heading says of all; with the
    heading's title."""
    for entry in re.split(r"^### ", text, flags=re.MULTILINE)[1:]:
        title, _, rest = entry.partition("\n")
        (origin,) = re.findall(r"\A\n\*(.+?)\*\n", rest, re.DOTALL) or [""]
        items = re.findall(r"^- .+?(?=^- |^$|\Z)", rest, re.DOTALL | re.MULTILINE)
        for item in items or [""]:
            yield title, f"{origin} {item}"


def test_every_finding_has_a_date_and_a_commit():
    found = list(findings(read("MEASURED.md")))
    assert len(found) > 80
    for title, finding in found:
        dated = re.search(r"20\d\d-\d\d-\d\d", finding) and re.search(r"`[0-9a-f]{7}`", finding)
        assert dated, f"{title}: {finding}"


def test_a_finding_without_a_commit_is_found():
    first = "### A\n\n*2026-11-28, `ef2bc4a`.*\n\n- one\n- two\n\n"
    text = f"{first}### B\n\n- three\n  goes on\n- four (2026-11-28)\n"
    assert list(findings(text)) == [
        ("A", "2026-11-28, `ef2bc4a`. - one\n"),
        ("A", "2026-11-28, `ef2bc4a`. - two\n"),
        ("B", " - three\n  goes on\n"),
        ("B", " - four (2026-11-28)\n"),
    ]


def _commands(parser: argparse.ArgumentParser, name: str = "") -> dict[str, set[str]]:
    """Options of a command and of all below it, by the words that lead there."""
    found = {name: {option for action in parser._actions for option in action.option_strings}}
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for word, below in action.choices.items():
                found |= _commands(below, f"{name} {word}".strip())
    return found


@pytest.mark.parametrize("document", [name for name in DOCUMENTS if name != "CONTRIBUTING.md"])
def test_every_command_and_option_exists(document):
    text = re.sub(r"`python -m tests[^`]*`", "", read(document))
    known = _commands(build_parser())
    words = {name.split()[0] for name in known if name}
    groups = {name.split()[0] for name in known if " " in name}
    for first, second in re.findall(r"`langflash ([a-z-]+)(?: ([a-z][a-z-]+))?", text):
        assert first in words, f"there is no langflash {first}"
        if second and first in groups:
            assert f"{first} {second}" in known, f"there is no langflash {first} {second}"
    told = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", text))
    assert told - set().union(*known.values()) <= ELSEWHERE and told


def test_hosted_checks_run_what_everybody_runs():
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "checks.yml").read_text(encoding="utf-8"))["jobs"]
    assert [step.get("run") for step in jobs["linux"]["steps"]][-2:] == ["make test", "make test-lab"]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"][0][
        "hooks"
    ]
    tools = {hook["entry"].split()[0].rpartition("/")[2] for hook in hooks}
    assert tools and all(f"$(BIN)/{tool}" in makefile for tool in tools)
