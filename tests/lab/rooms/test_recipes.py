"""Tables of furniture: what a row draws, whose name is whose, and errors that name the row."""

import re
import traceback
from collections import Counter

import numpy as np
import pytest

from langflash_core.lab.rooms import solids
from langflash_core.lab.rooms.design import STEEL, Design, Draw
from langflash_core.lab.rooms.parametric import PIECES
from langflash_core.lab.rooms.recipes import FOLDER, RECIPE, compiled

TABLE = """# Things to try.

_BAR = .5

_knob(d, y, look, at=0):
  add solids.box((.1, .1, .1), (at, y, 0)) | look

rack:  # Four bars, one lid.
  d, lid = Design('rack', 'rack'), Design('', '')
  many, high, odd = 2..2, .4~.4, 100%
  for k in range(many) -> box _BAR, high, \\
      .1 | k, 0, 0 | ?(STEEL, STEEL)
  if odd and not 0%
    _knob high | ?metal | at=9
  elif odd -> _knob 7 | STEEL
  else
    _knob 8 | STEEL
  box@lid 1, 1, 1 | 0, 5, 0 | STEEL
  d.parts += lid.parts

broken:
  d = Design('', '')

  box 1, 1, 1 | nowhere | STEEL
"""


def made(name: str, seed: int = 0) -> Design:
    names = {"Design": Design, "STEEL": STEEL, "solids": solids, "draw": Draw(np.random.default_rng(seed))}
    exec(compiled(TABLE, "tried.txt"), names)
    return names[name]()


def test_rows_draw_their_parts_in_order() -> None:
    design = made("rack")
    assert (design.name, design.group) == ("rack", "rack")
    middles = [t.reshape(-1, 3).mean(0).round(9).tolist() for t, _ in design.parts]
    assert middles == [[0, 0, 0], [1, 0, 0], [9, 0.4, 0], [0, 5, 0]]
    sizes = [np.ptp(t.reshape(-1, 3), axis=0).round(9).tolist() for t, _ in design.parts]
    assert sizes == [[0.5, 0.4, 0.1]] * 2 + [[0.1] * 3, [1] * 3]
    assert [look == STEEL for _, look in design.parts] == [True, True, False, True]


def test_draws_come_in_the_order_of_the_rows() -> None:
    draw = Draw(np.random.default_rng(3))
    _ = draw.count(2, 2), draw.between(0.4, 0.4), draw.chance(1), draw.one_of(1, 2), draw.one_of(1, 2)
    _ = draw.chance(0)
    assert made("rack", 3).parts[2][1] == draw.metal()


def test_an_error_names_the_row() -> None:
    with pytest.raises(NameError, match="nowhere") as caught:
        made("broken")
    last = traceback.extract_tb(caught.value.__traceback__)[-1]
    assert last.filename == "tried.txt"
    assert TABLE.splitlines()[(last.lineno or 0) - 1] == "  box 1, 1, 1 | nowhere | STEEL"


def test_names_are_given_once_and_used() -> None:
    """All tables know each other, so a name that is given twice would change other furniture."""
    lines = [line for path in sorted(FOLDER.glob("*.txt")) for line in path.read_text("utf-8").splitlines()]
    recipes = [found[1] for line in lines if (found := RECIPE.match(line))]
    constants = [
        n for line in lines if (found := re.match(r"([A-Z_, ]+) = ", line)) for n in found[1].split(", ")
    ]
    assert max(Counter([*recipes, *constants]).values()) == 1
    assert not {*recipes, *constants} & set(vars(solids))
    assert set(PIECES) <= set(recipes)
    words = Counter(re.findall(r"\w+", "\n".join(lines)))
    assert [name for name in (*recipes, *constants) if words[name] == 1 and name not in PIECES] == []
