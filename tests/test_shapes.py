"""Arrays carry their shapes in signatures: the third law of ARCHITECTURE.md, counted.

A place is a parameter or the result of a public function or method, or a public field of a class, whose
annotation names an array. It carries a shape where each array that it names is one of jaxtyping's, as in
`Float[Tensor, "V H W"]`. That shapes are true is checked at every call in tests (tests/conftest.py).
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import jaxtyping
import pytest

import langflash_core

ROOT = Path(langflash_core.__file__).parent
STAGES = ("types.py", "geometry", "splat", "language", "scene", "network")
ARRAYS = {"Tensor", "ndarray", "NDArray"}
SHAPED = {name for name in dir(jaxtyping) if isinstance(getattr(jaxtyping, name), type)}
ENOUGH = 0.9
"""What is left: arrays of any shape, as whole checkpoints hold them, and callables."""


def named(annotation: ast.expr) -> Iterator[bool]:
    """Of each array that an annotation names: whether it has a shape."""
    match annotation:
        case ast.Constant(value=str(text)):
            yield from named(ast.parse(text, mode="eval").body)
        case ast.Subscript(value=ast.Name(id=name)) if name in SHAPED:
            yield True
        case ast.Name(id=name) | ast.Attribute(attr=name) if name in ARRAYS:
            yield False
        case ast.Subscript(value=ast.Name(id="Literal")):
            pass
        case _:
            for inner in ast.iter_child_nodes(annotation):
                if isinstance(inner, ast.expr):
                    yield from named(inner)


def annotations(body: list[ast.stmt], path: str) -> Iterator[tuple[str, ast.expr]]:
    """What public functions and classes take, give and hold, by name."""
    for node in body:
        match node:
            case ast.ClassDef(name=name) if not name.startswith("_"):
                yield from annotations(node.body, f"{path}.{name}")
            case ast.AnnAssign(target=ast.Name(id=name)) if not name.startswith("_"):
                yield f"{path}.{name}", node.annotation
            case ast.FunctionDef(name=name, args=given) if name in ("__init__", "__call__") or name[0] != "_":
                every = (*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg)
                for one in every:
                    if one is not None and one.annotation is not None:
                        yield f"{path}.{name}({one.arg})", one.annotation
                if node.returns is not None:
                    yield f"{path}.{name} ->", node.returns


def places(stage: str) -> dict[str, bool]:
    """Every place of a stage that names arrays, and whether all of them have shapes."""
    top = ROOT / stage
    found = {}
    for file in [top] if top.is_file() else sorted(top.rglob("*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        for name, annotation in annotations(tree.body, file.relative_to(ROOT).as_posix()):
            arrays = list(named(annotation))
            if arrays:
                found[name] = all(arrays)
    return found


@pytest.mark.parametrize("stage", STAGES)
def test_arrays_carry_their_shapes(stage):
    found = places(stage)
    bare = [name for name, shaped in found.items() if not shaped]
    assert len(bare) <= (1 - ENOUGH) * len(found), f"{len(bare)} of {len(found)} without a shape: {bare}"


def test_a_bare_array_is_seen():
    source = """
def plain(a: Tensor, b: "np.ndarray | None" = None, c: int = 0) -> tuple[Float[Tensor, "N 3"], Tensor]: ...
def shaped(a: Float[Tensor, "N 3"], *more: Bool[np.ndarray, " N"]) -> list[Int[Tensor, " n"]]: ...
def _own(a: Tensor): ...
class Held:
    field: Tensor
    def method(self, a: Callable[[Tensor], Float[Tensor, "N"]]): ...
"""
    counted = {name: list(named(one)) for name, one in annotations(ast.parse(source).body, "m")}
    bare = {name for name, arrays in counted.items() if not all(arrays)}
    assert bare == {"m.plain(a)", "m.plain(b)", "m.plain ->", "m.Held.field", "m.Held.method(a)"}
    assert all(counted[f"m.shaped{place}"] == [True] for place in ("(a)", "(more)", " ->"))
