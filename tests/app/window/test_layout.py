"""The window's modules know each other without a circle, but for types, and by relative names alone."""

import ast
from pathlib import Path

import grimp
import pytest

import app.window

FOLDER = Path(app.window.__file__).parent
PACKAGE = app.window.__name__
FILES = sorted(FOLDER.rglob("*.py"))


def components(graph: dict[str, set[str]]) -> list[set[str]]:
    """What can be reached from each other, one set a component."""

    def reached(start: str, edges: dict[str, set[str]]) -> set[str]:
        found, queue = {start}, [start]
        while queue:
            new = edges[queue.pop()] - found
            found |= new
            queue += new
        return found

    back = {node: {other for other in graph if node in graph[other]} for node in graph}
    left, made = set(graph), []
    while left:
        start = min(left)
        made.append(reached(start, graph) & reached(start, back))
        left -= made[-1]
    return made


def test_a_circle_is_found() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}
    assert sorted(map(sorted, components(graph))) == [["a"], ["b", "c"], ["d"]]


def test_no_module_of_the_window_leads_back_to_itself() -> None:
    graph = grimp.build_graph(PACKAGE.partition(".")[0], cache_dir=None, exclude_type_checking_imports=True)
    ours = {module for module in graph.modules if module.startswith(PACKAGE)}
    edges = {module: graph.find_modules_directly_imported_by(module) & ours for module in ours}
    assert len(ours) > 50
    assert [sorted(each) for each in components(edges) if len(each) > 1] == []


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(FOLDER)))
def test_the_program_is_named_nowhere(file: Path) -> None:
    """A wheel installs it under another name than the folder has."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        names = [each.name for each in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.level == 0:
            names = [node.module or ""]
        assert not [name for name in names if name.partition(".")[0] == PACKAGE.partition(".")[0]]
