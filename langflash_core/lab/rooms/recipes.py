"""The reader of the tables of furniture, `furniture/*.txt`. Metres, y up, front +z.

A table holds constants (`NAME = value`) and recipes: a line `name(arguments):`, or `name:`, and under it
rows, two spaces in. Recipes and constants of all tables know each other. Rows are done one after another:

    box w, h, z | x, y, z | look   a part: a method of `Design` or another recipe, and what it is given;
                                   it goes to the design `d`, or as `box@lid` to the design `lid`
    w, h = .4~.6, 2*z              values; so begins a design: d = Design('stool', 'stool', ('bar stool',))
    for s in SIDES                 rows further in, or one behind ` -> `; so do if, elif, else and while
    return value                   ends a recipe; one that does not say so gives its design `d`

Values are expressions of Python, of what `solids`, `design` and numpy hold. At random, drawn in the order of
the rows: `.4~.6` is any number between, `2..4` a whole one, both ends included, `40%` true in so many cases,
`?(a, b)` one of them, `?wooden` or `?colour(.8)` another draw of `Draw`. A row that ends in a backslash goes
on in the next line.
"""

import ast
import re
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import CodeType, SimpleNamespace

import numpy as np

from langflash_core.lab.rooms import builtin, design, solids
from langflash_core.lab.rooms.design import Design, Draw

FOLDER = Path(__file__).resolve().parent / "furniture"
RECIPE = re.compile(r"(\w+)(\(.*\))?:(?:  #.*)?$")
_KNOWN = {name: value for module in (builtin, solids, design) for name, value in vars(module).items()}
_KNOWN |= {"np": np, "sin": np.sin, "cos": np.cos, "pi": np.pi}
_KNOWN |= {"pairwise": pairwise, "SimpleNamespace": SimpleNamespace}
_ROW = re.compile(r"( *)((?:.*\\\n)*.*)\n")
_NO_PART = re.compile(r" [-+*/]?= |^(return|continue|break|#|$)")
_SHORTHAND = (
    (r"(-?\d+)\.\.(-?\d+)", r"draw.count(\1, \2)"),
    (r"(-?[\d.]+)~(-?[\d.]+)", r"draw.between(\1, \2)"),
    (r"(?<![\w.])([\d.]+)%", r"draw.chance(\1 / 100)"),
    (r"\?(\w+)\b(?!\()", r"draw.\1()"),
    (r"\?(?=\w)", "draw."),
    (r"\?\(", "draw.one_of("),
)


def drawn(name: str, draw: Draw) -> Design:
    """What a recipe that needs no arguments draws.

    Raises:
        KeyError: no table holds a recipe of this name.
    """
    names = {**_KNOWN, "draw": draw}
    for table in _tables():
        exec(table, names)
    return names[name]()


@cache
def _tables() -> tuple[CodeType, ...]:
    return tuple(
        compiled(path.read_text(encoding="utf-8"), str(path)) for path in sorted(FOLDER.glob("*.txt"))
    )


def compiled(table: str, file: str) -> CodeType:
    """A table as a module of Python, line by line, so that errors name the lines of the table.

    Raises:
        SyntaxError: a row is none.
    """
    lines = []
    for indent, row in _ROW.findall(table):
        whole = re.sub(r"\\\n *", "", row)
        recipe = None if indent else RECIPE.match(whole)
        said = f"def {recipe[1]}{recipe[2] or '()'}:" if recipe else _statement(whole)
        lines.append(indent + said + "\n" * row.count("\n"))
    module = ast.parse("\n".join(lines), file)
    for recipe in module.body:
        if isinstance(recipe, ast.FunctionDef) and "d" in _given_names(recipe):
            recipe.body += ast.parse("return d").body
    return compile(ast.fix_missing_locations(module), file, "exec")


def _given_names(recipe: ast.FunctionDef) -> set[str]:
    """Arguments, and what is given a value in the rows."""
    stored = (n.id for n in ast.walk(recipe) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
    return {argument.arg for argument in recipe.args.args} | set(stored)


def _statement(row: str) -> str:
    """A row as Python says it."""
    head, arrow, rest = row.partition(" -> ")
    if row.startswith(("for ", "if ", "elif ", "else", "while ")):
        return f"{_longhand(head)}: {_statement(rest) if arrow else ''}".rstrip()
    if _NO_PART.search(row):
        return "return d" if row == "return" else _longhand(row)
    word, _, cells = row.partition(" ")
    word, _, into = word.partition("@")
    given = [c if re.match(r"\*|\w+=(?!=)", c) else f"({c})" for c in cells.split(" | ") if c]
    if hasattr(Design, word):
        return _longhand(f"{into or 'd'}.{word}({', '.join(given)})")
    return _longhand(f"{word}({', '.join([into or 'd', *given])})")


def _longhand(text: str) -> str:
    for short, long in _SHORTHAND:
        text = re.sub(short, long, text)
    return text
