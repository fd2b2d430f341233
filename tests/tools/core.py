"""How much there is to understand on the way from photos to a scene, in a checkout, and another beside it:

    python -m tests.tools.core [--code OLD] [--code .] [--names]

Read as text: nothing of a checkout is imported. The lab is left out. What is counted:

- numbers: names of a module that hold one, outside records
- reprojections: functions that say themselves where points lie in a photo
- neighbour rules: functions that choose photos for a photo, or pairs of photos
- rooms, returns: folders that `pipeline.reconstruct` gets into by calls, in the order of the source, each
  function once; and how often it gets into one that it had left. Aside stand those that hold arithmetic and
  data alone, and the corridor that calls one after the other. A method that one class alone has is that
  one's where the module that calls imports its module, itself or through others
"""

import argparse
import ast
import re
import sys
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

CORE = "langflash_core"
START = f"{CORE}.pipeline.reconstruct"
PRIMITIVES = (f"{CORE}.geometry.cameras", f"{CORE}.geometry.pinhole", f"{CORE}.rig")
ASIDE = ("base", "errors", "geometry", "pipeline", "reconstruction", "rig", "types")
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
PROJECTING = tuple(f"{CORE}.geometry.{name}" for name in ("cameras.project", "pinhole.to_pixels"))
CHOOSING = re.compile(
    r"list\[(int|list\[int\]|tuple\[int, int\])\]|tuple\[tuple\[int, \.\.\.\], \.\.\.\]|"
    r"Neighbours|Chosen|tuple\[Int\[Tensor, ' E'\], Int\[Tensor, ' E'\]\]"
)
OF_A_PHOTO = {"camera", "view"}
OF_PHOTOS = OF_A_PHOTO | {"viewmats", "num_views", "descriptors", "shared", "counts", "worth", "rig"}


def modules(checkout: Path) -> dict[str, ast.Module]:
    """Syntax of every module of the core by its dotted name, the lab left out."""
    found = {}
    for path in sorted((checkout / CORE).rglob("*.py")):
        parts = path.relative_to(checkout).with_suffix("").parts
        if "lab" not in parts:
            found[".".join(p for p in parts if p != "__init__")] = ast.parse(path.read_text(encoding="utf-8"))
    return found


def functions(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
    """Name, that of its class before it, and syntax of every function outside other functions."""
    for node in tree.body:
        if isinstance(node, FUNCTIONS):
            yield node.name, node
        if isinstance(node, ast.ClassDef):
            yield from ((f"{node.name}.{n.name}", n) for n in node.body if isinstance(n, FUNCTIONS))


def is_number(value: ast.expr | None) -> bool:
    """A number, or a tuple, sum, product or call (`np.radians`) of numbers."""
    match value:
        case ast.Constant(value=held):
            return isinstance(held, int | float) and not isinstance(held, bool)
        case ast.UnaryOp(operand=inner):
            return is_number(inner)
        case ast.BinOp(left=first, right=second):
            return is_number(first) and is_number(second)
        case ast.Tuple(elts=every) | ast.Call(args=every, keywords=[]):
            return bool(every) and all(map(is_number, every))
    return False


def constants(tree: ast.Module) -> list[str]:
    """Names at the top of a module that hold numbers."""
    names = []
    for node in tree.body:
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                    pairs = zip(target.elts, node.value.elts, strict=False)
                    names += [ast.unparse(one) for one, value in pairs if is_number(value)]
                elif is_number(node.value):
                    names.append(ast.unparse(target))
        elif isinstance(node, ast.AnnAssign) and is_number(node.value):
            names.append(ast.unparse(node.target))
    return names


def imported(tree: ast.Module) -> dict[str, str]:
    """Dotted names of what a module imports, by the names that it has there."""
    every = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module)
    return {one.asname or one.name: f"{node.module}.{one.name}" for node in every for one in node.names}


def is_reprojection(function: ast.AST, known: dict[str, str]) -> bool:
    """It calls what projects, or turns, divides, multiplies by a focal length and adds a principal point
    itself; known: what the module imported, by name."""
    called = (node.func for node in ast.walk(function) if isinstance(node, ast.Call))
    if any(isinstance(name, ast.Name) and known.get(name.id) in PROJECTING for name in called):
        return True
    if any(isinstance(n, ast.Attribute) and n.attr == "diagonal" for n in ast.walk(function)):
        return any(isinstance(n, ast.BinOp) and isinstance(n.op, ast.Div) for n in ast.walk(function))
    places = {
        ast.unparse(node.slice).strip("()").removeprefix("..., ").removeprefix(":, ").split(", None")[0]
        for node in ast.walk(function)
        if isinstance(node, ast.Subscript) and "K" in ast.unparse(node.value)
    }
    done = {type(node.op) for node in ast.walk(function) if isinstance(node, ast.BinOp)}
    whole = done >= {ast.MatMult, ast.Div, ast.Mult, ast.Add}
    return (
        whole and bool(places & {"0, 0", "axis, axis", "a, a"}) and bool(places & {"0, 2", "axis, 2", "a, 2"})
    )


def is_neighbour_rule(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """It gives one list of photos and is asked about a photo, or pairs, or a list for each; a list that is
    of all photos, such as their order, is none."""
    returns = ast.unparse(function.returns) if function.returns else ""
    given = {one.arg for one in (*function.args.args, *function.args.kwonlyargs)}
    asked = OF_A_PHOTO if returns == "list[int]" else OF_PHOTOS
    return bool(CHOOSING.fullmatch(returns)) and bool(given & asked)


class Walk:
    """What calls lead into, from one function on. entered: modules in the order of calls."""

    def __init__(self, trees: dict[str, ast.Module]):
        self._bodies = {
            f"{m}.{name}": (m, node) for m, tree in trees.items() for name, node in functions(tree)
        }
        self._known = {m: imported(tree) for m, tree in trees.items()}
        self._classes = {
            f"{m}.{node.name}"
            for m, tree in trees.items()
            for node in tree.body
            if isinstance(node, ast.ClassDef)
        }
        self._methods: dict[str, list[str]] = {}
        for path in self._bodies:
            if path.count(".") and path.rsplit(".", 1)[0] in self._classes:
                self._methods.setdefault(path.rsplit(".", 1)[1], []).append(path)
        self._near = {m: self._reached(m, set()) for m in trees}
        self._visited, self.entered = set[str](), list[str]()

    def _reached(self, module: str, found: set[str]) -> set[str]:
        """Modules that one imports, itself or through others, added to those found."""
        for path in self._known.get(module, {}).values():
            for other in (path, path.rpartition(".")[0]):
                if other in self._known and other not in found:
                    found.add(other)
                    self._reached(other, found)
        return found

    def follow(self, path: str) -> None:
        if path in self._visited or path not in self._bodies:
            return
        self._visited.add(path)
        module, function = self._bodies[path]
        if not self.entered or self.entered[-1] != module:
            self.entered.append(module)
        calls = [node for node in ast.walk(function) if isinstance(node, ast.Call)]
        for call in sorted(calls, key=lambda node: (node.end_lineno or 0, node.end_col_offset or 0)):
            for place in (call.func, *call.args):
                for target in self._targets(module, place):
                    self.follow(target)

    def _targets(self, module: str, called: ast.expr) -> list[str]:
        if isinstance(called, ast.Name):
            name = self._known[module].get(called.id, f"{module}.{called.id}")
            return [f"{name}.__init__", f"{name}.__post_init__"] if name in self._classes else [name]
        if isinstance(called, ast.Attribute):
            own = self._methods.get(called.attr, [])
            near = [path for path in own if path.startswith(f"{module}.")]
            alone = len(own) == 1 and self._bodies[own[0]][0] in self._near[module]
            return near or (own if alone else [])
        return []

    @property
    def rooms(self) -> list[str]:
        """Folders in the order of calls; a module outside folders is one."""
        folders = [name.split(".")[1] for name in self.entered]
        return [name for name, _ in groupby(name for name in folders if name not in ASIDE)]


def counts(checkout: Path) -> dict[str, list[str] | int]:
    """What is counted of a checkout, as names where it has some."""
    trees = modules(checkout)
    every = [(m, name, node) for m, tree in trees.items() for name, node in functions(tree)]
    outside = [each for each in every if not each[0].startswith(PRIMITIVES)]
    known = {m: imported(tree) for m, tree in trees.items()}
    walk = Walk(trees)
    sys.setrecursionlimit(10_000)
    walk.follow(START)
    return {
        "numbers named in modules": [f"{m}.{name}" for m, tree in trees.items() for name in constants(tree)],
        "reprojections": [f"{m}.{name}" for m, name, node in outside if is_reprojection(node, known[m])],
        "neighbour rules": [f"{m}.{name}" for m, name, node in outside if is_neighbour_rule(node)],
        "rooms": sorted(set(walk.rooms)),
        "returns": len(walk.rooms) - len(set(walk.rooms)),
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--code", type=Path, action="append", help="a checkout (default: this one)")
    parser.add_argument("--names", action="store_true", help="say what was counted, of the last one")
    given = parser.parse_args()
    columns = [counts(code) for code in given.code or [Path(__file__).parents[2]]]
    for name, last in columns[-1].items():
        figures = [len(found) if isinstance(found, list) else found for found in (c[name] for c in columns)]
        sys.stdout.write(f"| {name} | " + " | ".join(map(str, figures)) + " |\n")
        if given.names and isinstance(last, list):
            sys.stdout.writelines(f"    {one}\n" for one in last)
    return 0


if __name__ == "__main__":
    sys.exit(main())
