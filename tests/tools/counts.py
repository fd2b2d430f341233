"""How large and how tangled a checkout is, and another beside it:

    python -m tests.tools.counts [--code OLD] [--code .]

Read as text: nothing of a checkout is imported.
"""

import argparse
import ast
import statistics
import sys
from collections.abc import Iterator
from pathlib import Path

from tests import test_shapes

PRODUCT = ("app", "langflash_core", "shaders")
DOCUMENTS = ("README", "GUIDE", "LAB", "MEASURED", "ARCHITECTURE", "CONTRIBUTING", "CHANGELOG")
CARD = "assets/weights/mini_card.md"
CODE = (".py", ".glsl", ".frag", ".vert", ".js", ".css", ".html")
CLASSES = ("Viewport", "SplatBuffers", "State")
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_FORKS = (
    ast.If, ast.IfExp, ast.For, ast.AsyncFor, ast.While, ast.comprehension, ast.ExceptHandler, ast.match_case,
)  # fmt: skip


def code_files(folder: Path) -> Iterator[Path]:
    return (path for path in sorted(folder.rglob("*")) if path.suffix in CODE and path.is_file())


def lines(folder: Path) -> int:
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in code_files(folder))


def trees(checkout: Path) -> Iterator[tuple[str, ast.Module]]:
    """Name and syntax of every module of the product."""
    for top in PRODUCT:
        for path in sorted((checkout / top).rglob("*.py")):
            yield str(path.relative_to(checkout)), ast.parse(path.read_text(encoding="utf-8"))


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines from the first statement to the last, the docstring left out."""
    body = function.body[ast.get_docstring(function) is not None :]
    return (function.end_lineno or 0) - body[0].lineno + 1 if body else 0


def ways(function: ast.AST) -> int:
    """Ways through a body: one, and one more at each fork, those of functions in it included."""
    forks = 1
    for node in ast.walk(function):
        forks += isinstance(node, _FORKS)
        forks += len(node.values) - 1 if isinstance(node, ast.BoolOp) else 0
    return forks


def fields(cls: ast.ClassDef) -> tuple[int, int]:
    """Fields of a class, and how many of them are born outside `__init__`."""
    named = {n.target.id for n in cls.body if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)}
    inside, outside = set[str](), set[str]()
    for method in (node for node in cls.body if isinstance(node, FUNCTIONS)):
        stored = (
            n for n in ast.walk(method) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)
        )
        own = {n.attr for n in stored if isinstance(n.value, ast.Name) and n.value.id == "self"}
        (inside if method.name == "__init__" else outside).update(own)
    return len(named | inside | outside), len(outside - inside - named)


def shaped(checkout: Path) -> tuple[int, int]:
    """Public arrays that carry their shapes, of all, as `tests/test_shapes.py` counts them."""
    before, test_shapes.ROOT = test_shapes.ROOT, checkout / "langflash_core"
    try:
        found = [
            is_shaped for stage in test_shapes.STAGES for is_shaped in test_shapes.places(stage).values()
        ]
    finally:
        test_shapes.ROOT = before
    return sum(found), len(found)


def counts(checkout: Path) -> dict[str, str]:
    """What is counted of a checkout, by what it is called."""
    modules = dict(trees(checkout))
    functions = [n for tree in modules.values() for n in ast.walk(tree) if isinstance(n, FUNCTIONS)]
    bodies = sorted(map(body_lines, functions))
    with_shape, arrays = shaped(checkout)
    rows = {f"lines of {top}": f"{lines(checkout / top):,}" for top in PRODUCT}
    rows["lines of tests, without tools"] = f"{lines(checkout / 'tests') - lines(checkout / 'tests/tools'):,}"
    rows["lines of tools"] = f"{lines(checkout / 'tests/tools'):,}"
    rows["modules, longest of them"] = f"{len(modules)}, {max(_length(tree) for tree in modules.values())}"
    rows["bodies: median, 90th of 100, longest"] = (
        f"{statistics.median(bodies):.0f}, {bodies[len(bodies) * 9 // 10]}, {bodies[-1]}"
    )
    rows["bodies above 30 lines"] = str(sum(length > 30 for length in bodies))
    rows["most ways through a body"] = str(max(map(ways, functions)))
    classes = [n for tree in modules.values() for n in ast.walk(tree) if isinstance(n, ast.ClassDef)]
    for name in CLASSES:
        born, late = max(fields(cls) for cls in classes if cls.name == name)
        rows[f"fields of {name}, outside `__init__`"] = f"{born}, {late}"
    rows["public arrays with shapes"] = f"{with_shape} of {arrays}"
    for path in (*(checkout / f"{name}.md" for name in DOCUMENTS), checkout / CARD):
        words = len(path.read_text(encoding="utf-8").split()) if path.is_file() else 0
        rows[f"words of {path.name}"] = f"{words:,}"
    return rows


def _length(tree: ast.Module) -> int:
    return max((node.end_lineno or 0 for node in tree.body), default=0)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--code", type=Path, action="append", help="a checkout (default: this one)")
    given = parser.parse_args().code or [Path(__file__).parents[2]]
    columns = [counts(code) for code in given]
    sys.stdout.write("| | " + " | ".join(code.resolve().name for code in given) + " |\n")
    sys.stdout.write("|---" * (len(given) + 1) + "|\n")
    for name in columns[-1]:
        sys.stdout.write(f"| {name} | " + " | ".join(column[name] for column in columns) + " |\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
