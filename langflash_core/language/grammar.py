"""A phrase as people say it, read by a small grammar: a thing, and what tells it from others of its kind.

    phrase    = noun phrase { relation noun phrase } | noun phrase, negation
    noun      = [number] { look | size | place } head

The head is the longest end of the words that the table of household words (`vocabulary.py`), this file's
`_FURTHER`, or what the scene was taught holds: "coffee table" stays whole. Language answers the head; looks
(`looks.py`), sizes, places, order and relations (`narrowing.py`) choose among what answers it. What is within
quotes, a sum of meanings (`algebra.py`), or holds no head, is asked as it stands.
"""

import re
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal

from langflash_core.language.hints import denies, taken_away
from langflash_core.language.looks import LOOKS, TONES
from langflash_core.language.vocabulary import all_phrases

Kind = Literal["look", "size", "place", "order", "count", "relation"]

_FURTHER = frozenset(
    """
    monitor mouse cable wire pipe handle knob drawer tap toolbox sign bottle bucket counter island statue
    sculpture flag banner helmet wheel tire car machine drill saw workbench rope hose tripod glove shoe tree
    flower ball vacuum_cleaner iron ironing_board hair_dryer bulb light lights fridge binder folder column
    pillar beam stairs staircase railing step plate knife fork spoon glass can pot kettle hat coat jacket
    shirt desk_lamp board paper card letter robot train_set screen panel frame window_sill shutter blinds
    bar_stool bean_bag toilet_seat tool_box door_handle rocking_chair folding_chair office_chair cash_register
    vending_machine sewing_machine ping_pong_table side_table end_table work_bench filing_cabinet power_strip
    extension_cord first_aid_kit water_dispenser microphone loudspeaker basketball football globe map skirting
    cutting_board chopping_board napkin candle_holder rack shelf_unit backrest wooden_floor
    """.split()  # noqa: SIM905
)
"""Names of things that the table lacks, `_` for a space: the text model knows them, networks were not taught
them."""
_ARTICLES = frozenset("the a an some any my your our this that these those all every each".split())  # noqa: SIM905
_SIZES = {
    "big": "big", "large": "big", "huge": "big", "bigger": "big", "larger": "big", "biggest": "big",
    "largest": "big", "small": "small", "little": "small", "tiny": "small", "smaller": "small",
    "smallest": "small", "tall": "tall", "taller": "tall", "tallest": "tall", "high": "tall",
    "highest": "upper", "short": "short", "shorter": "short", "shortest": "short", "wide": "wide",
    "wider": "wide", "widest": "wide", "long": "wide", "longer": "wide", "longest": "wide",
    "narrow": "narrow", "narrower": "narrow", "narrowest": "narrow",
}  # fmt: skip
_PLACES = {
    "left": "left", "leftmost": "left", "right": "right", "rightmost": "right", "upper": "upper",
    "top": "upper", "topmost": "upper", "uppermost": "upper", "lower": "lower", "bottom": "lower",
    "lowest": "lower", "lowermost": "lower", "nearest": "nearest", "closest": "nearest", "near": "nearest",
    "front": "nearest", "farthest": "farthest", "furthest": "farthest", "far": "farthest", "back": "farthest",
    "rear": "farthest", "distant": "farthest", "middle": "middle", "central": "middle", "center": "middle",
    "centre": "middle",
}  # fmt: skip
_SIZED = {word: name for word, name in _SIZES.items() if name not in _PLACES.values()}
_PLACED = _PLACES | {word: name for word, name in _SIZES.items() if word not in _SIZED}
_NUMBERS = {
    "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9,
    "ten": 10, "both": 2, "a pair of": 2,
}  # fmt: skip
_ORDINALS = {
    "first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5, "sixth": 6, "seventh": 7, "eighth": 8,
    "ninth": 9, "tenth": 10, "last": -1, "1st": 1, "2nd": 2, "3rd": 3, "4th": 4, "5th": 5,
}  # fmt: skip
_RELATIONS = {
    "on": "on", "on top of": "on", "upon": "on", "atop": "on", "onto": "on", "against": "on", "along": "on",
    "in": "in", "inside": "in", "inside of": "in", "within": "in", "under": "under", "below": "under",
    "beneath": "under", "underneath": "under", "above": "above", "over": "above", "beside": "beside",
    "next to": "beside", "near": "beside", "close to": "beside", "by": "beside", "at": "beside",
    "adjacent to": "beside", "alongside": "beside", "around": "beside", "in front of": "in front of",
    "before": "in front of", "behind": "behind", "in back of": "behind", "between": "between",
    "in between": "between", "left of": "left of", "to the left of": "left of", "on the left of": "left of",
    "right of": "right of", "to the right of": "right of", "on the right of": "right of", "with": "with",
    "nearest to": "nearest to", "closest to": "nearest to", "nearest": "nearest to",
    "closest": "nearest to", "farthest from": "farthest from", "furthest from": "farthest from",
    "far from": "farthest from", "away from": "farthest from", "without": "without",
}  # fmt: skip
_VERBS = r"(?:(?:that|which|who) (?:is|are) )?(?:(?:standing|sitting|lying|hanging|placed|leaning|mounted) )?"
_RELATION = re.compile(
    rf"(?P<left>.+?),? {_VERBS}(?P<word>"
    + "|".join(sorted(_RELATIONS, key=lambda word: -len(word)))
    + r") (?P<right>.+)"
)
_TAIL = re.compile(  # "the chair on the left", "the second chair from the right"
    r"(?P<rest>.+?),? (?:(?:that is |which is )?(?:on|at|to|in|from) (?:the |its )?(?:far )?)"
    r"(?P<word>left|right|top|bottom|middle|center|centre|front|back|foreground|background)(?: side)?"
)
_GROUNDS = {"foreground": "nearest", "background": "farthest"}
_SIDES = ("left", "right", "upper", "lower", "nearest", "farthest")
_NOT_LOOK = re.compile(
    r"(?P<rest>.+?),? (?:(?:that|which) )?(?:(?:is|are) not|isn't|aren't|but not|not) (?:the )?"
    r"(?P<word>[a-z ]+?)(?: ones?)?"
)
_CLAUSE = re.compile(r"\b(?:to|what|who|where|whose|for|you|your|people|does|has|have|holds|of)\b")
_QUOTED = re.compile(r"\s*(?:\"(.+)\"|\u201c(.+)\u201d|'(.+)'|\u00ab(.+)\u00bb)\s*")
_MOST_WORDS = 24  # of a phrase that is read; longer ones are sentences


@dataclass(frozen=True)
class Modifier:
    """One thing that a phrase says of its head.

    word: the look, size, place or relation, by the name that `narrowing.py` knows; of an order the side that
    is counted from. number: of an order (from 1, -1 the last one) or of a count. others: what a relation is
    to. most: a superlative or one alone, so that one thing is meant, not several.
    """

    kind: Kind
    word: str
    negated: bool = False
    number: int = 0
    others: tuple["Reading", ...] = ()
    most: bool = True

    def __str__(self) -> str:
        plain = self.word
        if self.kind == "relation":
            named = (f"({other})" if other.narrows else str(other) for other in self.others)
            plain = f"{self.word} {' and '.join(named)}"
        elif self.kind == "order":
            name = next((word for word, number in _ORDINALS.items() if number == self.number), "")
            plain = f"{name} from the {self.word}"
        elif self.kind == "count":
            plain = f"{self.number} of them"
        return f"not {plain}" if self.negated else plain


@dataclass(frozen=True)
class Reading:
    """How a phrase is understood.

    phrase: as written. head: what language is asked. known: the head is a name of a thing. ignored: words
    that say something which nobody can check. `str` gives it for people: "chair, white".
    """

    phrase: str
    head: str
    known: bool = True
    modifiers: tuple[Modifier, ...] = ()
    ignored: tuple[str, ...] = field(default=())

    @property
    def narrows(self) -> bool:
        """Whether it chooses among what answers its head."""
        return bool(self.modifiers)

    @property
    def whole(self) -> bool:
        """Whether the phrase is asked as it stands."""
        return not (self.modifiers or self.ignored) and self.head == strip_quotes(self.phrase)

    @property
    def heads(self) -> tuple[str, ...]:
        """Its head, then those of the things that it is related to."""
        others = (head for each in self.modifiers for other in each.others for head in other.heads)
        return (self.head, *others)

    def __str__(self) -> str:
        return ", ".join((self.head, *(str(each) for each in self.modifiers)))


def whole(phrase: str) -> Reading:
    """A phrase that is asked as it stands."""
    return Reading(phrase, strip_quotes(phrase))


def strip_quotes(phrase: str) -> str:
    """A phrase without the quotes around it, if there are."""
    quoted = _QUOTED.fullmatch(phrase)
    return next(part for part in quoted.groups() if part) if quoted else phrase.strip()


def read_phrase(phrase: str, taught: Collection[str] = ()) -> Reading:
    """How a phrase is understood; one that the grammar makes nothing of stays whole.

    Args:
        taught: phrases that this scene was taught beside the table's.
    """
    as_it_stands = whole(phrase)
    unknown = replace(as_it_stands, known=False)
    plain = " ".join(phrase.lower().replace("\u2019", "'").rstrip(".!?").split())
    if _QUOTED.fullmatch(phrase) or re.search(r"(?:^|\s)[+-](?:\s|$)", plain):
        return as_it_stands
    known = _names() | {each.lower() for each in taught}
    if not plain or plain in known:
        return as_it_stands
    if len(plain.split()) > _MOST_WORDS or (denies(plain) and not _looks(plain.split()[1:2])):
        return unknown
    found = _phrase(plain, known)
    return unknown if found is None or not (found.known or found.modifiers) else replace(found, phrase=phrase)


def _phrase(plain: str, known: Collection[str]) -> Reading | None:
    """A phrase with what stands behind its noun; None where it has no head."""
    for split in (_not_look, _tail, _read_relation, _without):
        found = split(plain, known)
        if found is not None:
            return found
    return None if _CLAUSE.search(plain) else _noun(plain, known)


def _not_look(plain: str, known: Collection[str]) -> Reading | None:
    """ "chair that is not red"; None where it is none of these."""
    found = _NOT_LOOK.fullmatch(plain)
    looks = () if found is None else _looks(found["word"].split())
    rest = _phrase(found["rest"], known) if found and looks else None
    return None if rest is None else _with(rest, *(replace(look, negated=True) for look in looks))


def _tail(plain: str, known: Collection[str]) -> Reading | None:
    """ "chair on the left", "second chair from the right"; None where it is none of these."""
    found = _TAIL.fullmatch(plain)
    rest = _phrase(found["rest"], known) if found else None
    if found is None or rest is None:
        return None
    side = _GROUNDS.get(found["word"]) or _PLACES[found["word"]]
    ordered = [each for each in rest.modifiers if each.kind == "order"]
    if ordered and side in _SIDES:
        others = tuple(each for each in rest.modifiers if each.kind != "order")
        return replace(rest, modifiers=(*others, replace(ordered[0], word=side)))
    return _with(rest, Modifier("place", side, most=not _plural(found["rest"].split()[-1], known)))


def _read_relation(plain: str, known: Collection[str]) -> Reading | None:
    """ "lamp above the table"; None without a relation between things that both are known."""
    found = _RELATION.fullmatch(plain)
    if found is None or (left := _noun(found["left"], known)) is None or not left.known:
        return None
    word, sides = _RELATIONS[found["word"]], [found["right"]]
    if word == "between":
        sides = re.split(r" and ", found["right"], maxsplit=1)
    others = [_phrase(side, known) for side in sides]
    if any(other is None or not other.known for other in others):
        if word in ("with", "without"):  # "chair with arm rests" tells what it is
            return None
        return replace(left, ignored=(*left.ignored, f"{found['word']} {found['right']}"))
    named = tuple(other for other in others if other is not None)
    if word == "without":
        return None  # a minus says that
    return _with(left, Modifier("relation", word, others=named))


def _without(plain: str, known: Collection[str]) -> Reading | None:
    """ "chair but not the armchair" as a minus; None without such a negation of a thing that is known."""
    taken = taken_away(plain)
    if taken is None:
        return None
    more, less = (_noun(side, known) for side in taken)
    if more is None or less is None or not (more.known and less.known) or less.narrows or less.ignored:
        return None
    return replace(more, head=f"{more.head} - {less.head}")


def _with(reading: Reading, *modifiers: Modifier) -> Reading:
    return replace(reading, modifiers=(*reading.modifiers, *modifiers))


def _noun(plain: str, known: Collection[str]) -> Reading | None:
    """Numbers, adjectives and a head; `known` is false of a head that is none of the names. None without."""
    words = re.findall(r"[^\s,]+", plain)
    while words and words[0] in _ARTICLES:
        words = words[1:]
    for start in range(len(words)):
        head = _single(" ".join(words[start:]), known)
        if head is not None:
            while start and _single(words[start - 1], known) and not _adjective(words[start - 1], True):
                start -= 1  # "floor lamp": a name of two
                head = f"{words[start]} {head}"
            modifiers, ignored = _read_adjectives(words[:start], _plural(words[-1], known))
            return Reading(plain, head, True, modifiers, ignored)
    kept = 0
    while kept < len(words) and (
        _read_adjectives(words[kept : kept + 1], False)[0] or words[kept] in _ARTICLES
    ):
        kept += 1
    if kept == len(words):
        return None
    modifiers, ignored = _read_adjectives(words[:kept], False)
    return Reading(plain, " ".join(words[kept:]), False, modifiers, ignored)


def _read_adjectives(words: list[str], several: bool) -> tuple[tuple[Modifier, ...], tuple[str, ...]]:
    """What adjectives say, and those that say nothing that could be checked."""
    found, ignored, negated = list[Modifier](), list[str](), False
    for word in words:
        if word in ("not", "non"):
            negated = True
            continue
        own = _adjective(word, several)
        if own is not None:
            found.append(replace(own, negated=negated))
        elif word not in _ARTICLES and word not in ("and", "very", "of", "pair", "coloured", "colored"):
            ignored.append(f"not {word}" if negated else word)
        negated = False
    return tuple(dict.fromkeys(found)), tuple(ignored)


def _adjective(word: str, several: bool) -> Modifier | None:
    plain = word.removesuffix("-coloured").removesuffix("-colored").removesuffix("ish")
    plain = {"redd": "red", "grey-": "grey"}.get(plain, plain)
    most = not several or word.endswith(("est", "most"))
    if word in LOOKS or plain in LOOKS:
        return Modifier("look", word if word in LOOKS else plain)
    if word in TONES:
        return Modifier("look", TONES[word])
    if word in _ORDINALS:
        return Modifier("order", "left", number=_ORDINALS[word])
    if word in _SIZED:
        return Modifier("size", _SIZED[word], most=most)
    if word in _PLACED:
        return Modifier("place", _PLACED[word], most=most)
    number = _NUMBERS.get(word, int(word) if word.isdecimal() and len(word) < 3 else 0)
    return Modifier("count", "", number=number) if number > 1 or (number and several) else None


def _looks(words: list[str]) -> tuple[Modifier, ...]:
    """The looks that some words are; none where one of them is something else."""
    found, ignored = _read_adjectives(words, False)
    return () if ignored or any(each.kind != "look" for each in found) else found


def _plural(word: str, known: Collection[str]) -> bool:
    return (_single(word, known) != word and word.endswith("s")) or word in ("books", "lights", "people")


def _single(words: str, known: Collection[str]) -> str | None:
    """A name as the table has it, of one thing; None where that lacks it."""
    forms = [words]
    if words.endswith("ves"):
        forms += [f"{words[:-3]}f", f"{words[:-3]}fe"]
    if words.endswith("s") and not words.endswith("ss"):
        forms = [words.removesuffix("s"), words.removesuffix("es"), *forms]
    return next((form for form in forms if form in known), None)


@lru_cache(maxsize=1)
def _names() -> frozenset[str]:
    """Everything that can be a head."""
    return frozenset(phrase.lower() for phrase in all_phrases()) | {
        word.replace("_", " ") for word in _FURTHER
    }
