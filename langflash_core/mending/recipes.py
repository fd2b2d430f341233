"""What to clean up, as a small JSON file that can be applied to other scenes:

    {"format": "langflash-recipe", "version": 1, "strength": 0.5, "kinds": ["floaters", "sheets"],
     "rules": [{"opacity": [null, 0.1], "size": [0.2, null]}], "within": ["chair"], "invert": false,
     "crop": "core" or [low x, y, z, high x, y, z]}

A Gaussian goes that `strength.py` finds at the strength, or of which all conditions of one rule hold, if it
answers a phrase of `within` (or there is none); with `invert` all others of those go instead. What lies
outside the crop box goes in any case. Only the standard library is imported here.
"""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from langflash_core.base.files import write_atomically
from langflash_core.base.limits import TEXT
from langflash_core.errors import InputError
from langflash_core.mending.settings import RECIPE_DEFAULTS

FORMAT, VERSION = "langflash-recipe", 1
HOWS = ("blur", "pixels", "remove")
"""How a part can be hidden (`hiding.py`)."""
KINDS = ("floaters", "sheets", "flyaways", "crumbs")
MEASURES = ("confidence", "size", "opacity", "depth", "photos")
"""What a rule may bound: sureness of depth in [0, 1]; radius, scene units; opacity in [0, 1]; distance from
the nearest photo's place, scene units; how many photos see it."""
COLOUR = "colour"  # red, green, blue in [0, 1], and how far a channel may be off
PRESETS = ("core", "room")
_KEYS = ("format", "version", "strength", "kinds", "rules", "within", "invert", "crop")
_BOUND = re.compile(r"([a-z]+)\s*([<>])\s*(\S+)")
_SHADE = re.compile(r"colour\s*~\s*#([0-9a-fA-F]{6})(?::(\S+))?")

Rule = Mapping[str, tuple[float | None, ...]]
"""Conditions by name: a low and a high bound, each may be missing; of a colour its three parts, and how far
off."""
Box = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Recipe:
    """strength: 0 finds nothing of the kinds. crop: a preset, or the low and the high corner, scene units.

    Raises:
        InputError: out of range, or unknown.
    """

    strength: float = 0.0
    kinds: tuple[str, ...] = KINDS
    rules: tuple[Rule, ...] = ()
    within: tuple[str, ...] = ()
    invert: bool = False
    crop: str | Box | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.strength <= 1:
            raise InputError(f"a strength of {self.strength:g} is out of range; choose 0 to 1")
        for kind in self.kinds:
            if kind not in KINDS:
                raise InputError(f"there is no kind '{kind}' to clean up; choose {', '.join(KINDS)}")
        for rule in self.rules:
            _check_rule(rule)
        if isinstance(self.crop, str) and self.crop not in PRESETS:
            raise InputError(f"there is no box '{self.crop}'; choose {', '.join(PRESETS)}, or six numbers")
        box = self.crop if isinstance(self.crop, tuple) else (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
        if not all(low < high for low, high in zip(box[:3], box[3:], strict=True)):
            raise InputError(
                "a box's first three numbers are its low corner; each must be below its high one"
            )

    @property
    def empty(self) -> bool:
        """Whether nothing would go."""
        return not (self.strength and self.kinds) and not self.rules and self.crop is None

    def document(self) -> dict[str, Any]:
        """As its file has it."""
        values = (self.strength, self.kinds, self.rules, self.within, self.invert, self.crop)
        return dict(zip(_KEYS, (FORMAT, VERSION, *values), strict=True))


def parsed_rule(text: str) -> Rule:
    """A rule out of words: "opacity<.1,size>.2", "photos<2", "colour~#808080:.1".

    Raises:
        InputError: it cannot be understood.
    """
    rule: dict[str, Any] = {}
    for part in text.split(","):
        bound, shade = _BOUND.fullmatch(part.strip()), _SHADE.fullmatch(part.strip())
        if shade:
            red, green, blue = (int(shade[1][at : at + 2], 16) / 255 for at in (0, 2, 4))
            rule[COLOUR] = (red, green, blue, _number(shade[2] or str(RECIPE_DEFAULTS.off)))
        elif bound:
            low, high = rule.get(bound[1], (None, None))
            limit = _number(bound[3])
            rule[bound[1]] = (low, limit) if bound[2] == "<" else (limit, high)
        else:
            raise InputError(
                f"'{part.strip()}' is no condition; say one as opacity<.1, size>.2 or colour~#808080:.1"
            )
    _check_rule(rule)
    return rule


def parsed_box(text: str) -> str | Box:
    """A preset, or six numbers with commas.

    Raises:
        InputError: neither.
    """
    if text in PRESETS:
        return text
    words = text.split(",")
    if len(words) != 6:
        raise InputError(f"'{text}' is no box; choose {', '.join(PRESETS)}, or six numbers X,Y,Z,X,Y,Z")
    a, b, c, d, e, f = (_number(word) for word in words)
    return a, b, c, d, e, f


def save_recipe(recipe: Recipe, path: Path) -> None:
    """Write a recipe.

    Raises:
        OutputError: the path cannot be written.
    """
    write_atomically(path, (json.dumps(recipe.document(), indent=1) + "\n").encode())


def load_recipe(path: Path) -> Recipe:
    """Read a recipe.

    Raises:
        InputError: missing, damaged, of a newer version, or no recipe.
    """
    try:
        TEXT.check(path.stat().st_size, path.name, InputError)
        content = json.loads(path.read_bytes())
        if not isinstance(content, dict) or content.get("format") != FORMAT:
            raise ValueError("it is no recipe")
        if content.get("version") != VERSION or set(content) - set(_KEYS):
            raise InputError(f"{path.name} was written by a newer LangFlash; update LangFlash")
        return _recipe(content)
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); check the path") from error
    except (ValueError, LookupError, TypeError, ArithmeticError, RecursionError) as error:
        said = " ".join(str(error).split())[:100]
        raise InputError(f"{path.name} is damaged ({said}); save the recipe again") from error


def _recipe(content: dict[str, Any]) -> Recipe:
    crop, texts = content.get("crop"), [*content.get("within", []), *content.get("kinds", KINDS)]
    if not all(isinstance(text, str) for text in texts) or not isinstance(content.get("invert", False), bool):
        raise ValueError("expected phrases, kinds, and whether to invert")
    if not all(isinstance(rule, dict) for rule in content.get("rules", [])):
        raise ValueError("expected conditions by name")
    bounds = [value for rule in content.get("rules", []) for values in rule.values() for value in values]
    numbers = [value for value in bounds if value is not None]
    if not all(isinstance(value, int | float) and math.isfinite(value) for value in numbers):
        raise InputError("the conditions of a recipe need finite numbers; save the recipe again")
    rules = [{name: tuple(values) for name, values in rule.items()} for rule in content.get("rules", [])]
    return Recipe(
        strength=float(content.get("strength", 0.0)),
        kinds=tuple(content.get("kinds", KINDS)),
        rules=tuple(rules),
        within=tuple(content.get("within", [])),
        invert=content.get("invert", False),
        crop=crop if crop is None or isinstance(crop, str) else parsed_box(",".join(map(str, crop))),
    )


def _check_rule(rule: Rule) -> None:
    """Raises InputError."""
    if not rule:
        raise InputError("a rule needs a condition; say one as opacity<.1")
    for name, values in rule.items():
        numbers: Sequence[Any] = [value for value in values if value is not None]
        if name not in (*MEASURES, COLOUR):
            raise InputError(f"there is no measure '{name}'; choose {', '.join((*MEASURES, COLOUR))}")
        whole, least = (4, 4) if name == COLOUR else (2, 1)
        if len(values) != whole or len(numbers) < least:
            raise InputError(
                f"the condition on {name} lacks a number; say one as opacity<.1 or colour~#808080:.1"
            )


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"'{text}' is no number; write one as 0.5") from None
    if not math.isfinite(value):
        raise InputError(f"'{text}' is not finite; write a number as 0.5")
    return value
