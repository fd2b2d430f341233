"""What a phrase is told where it may not mean what was written: a negation, a slip, a word nobody taught.

Text towers read past "no" and "but not": "no floor" lies beside "floor". What takes meaning away is the minus
of `algebra.py`, so a negation is told how to write that. Words are known where the text model's vocabulary or
the table of household words holds them; the rest are slips where one household word is near.

Source of the distance: Damerau 1964; optimal string alignment.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import lru_cache

from langflash_core.errors import PromptError
from langflash_core.language.algebra import terms
from langflash_core.language.minilm import load_minilm
from langflash_core.language.settings import HINTS
from langflash_core.language.vocabulary import all_phrases
from langflash_core.types import Scene, Semantics

_ARTICLE = r"(?:the |a |an |any )?"
_ALL = r"(?:anything|everything|all|any|things|whatever)"
_BUT = r"(?:but(?: for)?|except(?: for)?|other than|apart from|besides|excluding|without)"
_IS_NOT = r"(?:(?:that|which|what) (?:is not|are not|isn't|aren't))"
_ALONE = re.compile(
    rf"(?P<word>{_ALL} {_BUT}|(?:{_ALL} )?{_IS_NOT}|not|no|without|except(?: for)?|excluding) {_ARTICLE}"
    r"(?P<less>.+)|(?P<non>non)-(?P<thing>\w+)"
)
_BESIDE = re.compile(
    r"(?P<more>(?!nothing\b).+?),? (?P<word>(?:but|and|with) (?:not|no|without)|except(?: for)?|other than|"
    rf"apart from|excluding|without|not|{_IS_NOT}) {_ARTICLE}(?P<less>.+)"
)
_SIGNS = re.compile(r"\b(?:sign|poster|sticker|label)s?$")  # "no smoking sign" is a thing
_ENDINGS = ("s", "es", "ed", "d", "ing", "er", "y")


def hint(phrase: str, taught: Collection[str] = ()) -> str:
    """One sentence for people, or "": for a phrase in the space `minilm`.

    Args:
        taught: phrases that this scene was taught beside the table's.
    """
    plain = " ".join(phrase.lower().replace("\u2019", "'").split())
    known = _household()
    if plain in known.phrases or plain in {each.lower() for each in taught}:
        return ""
    own = frozenset(word for each in taught for word in _words(each))
    return _negation_hint(plain) or _misspelt(plain, own)


def hints(scene: Scene | Semantics, phrases: Sequence[str]) -> tuple[str, ...]:
    """What people should know of phrases that a scene is asked, "" for most; of one text model's alone."""
    semantics = scene.semantics if isinstance(scene, Scene) else scene
    if semantics.space != "minilm":
        return ("",) * len(phrases)
    taught = tuple(scene.record.atom_names.values()) if isinstance(scene, Scene) else ()
    return tuple(hint(phrase, taught) for phrase in phrases)


def reads_foreign(text: str) -> bool:
    """Whether a phrase has words, and none that the text model's vocabulary and the table of household words
    hold: one in another language, or a rare one. The model was made of English.

    Word pieces do not count: every word has those; nor do short words beside longer ones, articles among
    them. Of 14 German, French, Spanish and Italian words for furniture that English does not have, all are
    told. Two English words in one are English ("typewriter").
    """
    words = _significant_words(text)
    return bool(words) and not any(_is_known_word(word) or _is_compound(word) for word in words)


def _negation_hint(plain: str) -> str:
    """What to write instead of a negation; "" where there is none."""
    try:
        if len(terms(plain)) > 1 or _SIGNS.search(plain):
            return ""
    except PromptError:  # compiling says that
        return ""
    if alone := _ALONE.fullmatch(plain):
        word, less = alone["word"] or "non", alone["less"] or alone["thing"]
        more = "floor" if less == "wall" else "wall"
        return (
            f'"{word}" takes nothing away, so this looks for "{less}" itself; '
            f'write what you look for, a minus and what it is not, as in "{more} - {less}"'
        )
    if beside := _BESIDE.fullmatch(plain):
        return f'"{beside["word"]}" takes nothing away; write "{_more(beside)} - {beside["less"]}"'
    return ""


def denies(plain: str) -> bool:
    """Whether a phrase says what something is not, and nothing else; "no smoking sign" is a thing."""
    return bool(_ALONE.fullmatch(plain) or (_SIGNS.search(plain) and plain.startswith("no ")))


def taken_away(plain: str) -> tuple[str, str] | None:
    """What a negation leaves, and what it takes away from that; None where there is none, or nothing else."""
    if _SIGNS.search(plain) or _ALONE.fullmatch(plain):
        return None
    beside = _BESIDE.fullmatch(plain)
    return None if beside is None else (_more(beside), beside["less"])


def _more(beside: re.Match[str]) -> str:
    return re.sub(rf"^{_ARTICLE}", "", beside["more"])


def _misspelt(plain: str, own: frozenset[str]) -> str:
    """The nearest household word of a slip; or which word is not known, where none of the phrase is."""
    unknown = [word for word in _significant_words(plain) if not _is_known_word(word) and word not in own]
    for word in unknown:
        if near := _nearest(word, own):
            return f'"{word}" is not a word this model knows; did you mean "{near}"?'
    if unknown and reads_foreign(plain) and not own.intersection(_significant_words(plain)):
        return f'"{unknown[0]}" is not a word this model knows well; try a more common word, in English'
    return ""


def _words(text: str) -> list[str]:
    return re.findall(r"[^\W\d_]{3,}", text.lower())


def _significant_words(text: str) -> list[str]:
    """Its longer words; shorter ones, articles among them, only where there is no other."""
    words = _words(text)
    return [word for word in words if len(word) >= HINTS.shortest] or words


def _is_known_word(word: str) -> bool:
    there, ours = load_minilm().tokenizer.token_to_id, _household().words
    stems = (word, *(word.removesuffix(end) for end in _ENDINGS if len(word) - len(end) >= HINTS.shortest))
    return any(there(stem) is not None or stem in ours for stem in stems)


def _is_compound(word: str) -> bool:
    """Whether it is two words of the text model in one."""
    there = load_minilm().tokenizer.token_to_id
    cuts = range(HINTS.shortest, len(word) - HINTS.shortest + 1)
    return any(there(word[:cut]) is not None and there(word[cut:]) is not None for cut in cuts)


def _nearest(word: str, own: frozenset[str]) -> str:
    """The household word that so few edits lead to, names of groups first; "" where there is none.

    Whoever mistypes a word seldom does so at its first letter.
    """
    if len(word) < HINTS.shortest:
        return ""
    most, best = 1 + (len(word) >= HINTS.long), ("", 3)
    for other in (*_household().names.get(word[0], ()), *sorted(own)):
        near = other[0] == word[0] and len(set(word) ^ set(other)) <= 2 * most >= 2 * abs(
            len(word) - len(other)
        )
        if near and (edits := _edits(word, other)) < best[1] and edits <= most:
            best = other, edits
    return best[0]


def _edits(one: str, other: str) -> int:
    """Letters to add, drop, change or swap with the next one."""
    before, row = list[int](), list(range(len(other) + 1))
    for i, a in enumerate(one, 1):
        above, before, row = before, row, [i]
        for j, b in enumerate(other, 1):
            least = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (a != b))
            if i > 1 and j > 1 and a == other[j - 2] and b == one[i - 2]:
                least = min(least, above[j - 2] + 1)
            row.append(least)
    return row[-1]


@dataclass(frozen=True)
class _Household:
    """Phrases and words of the table. names: words to propose, by first letter, those of groups first."""

    phrases: frozenset[str]
    words: frozenset[str]
    names: dict[str, tuple[str, ...]]


@lru_cache(maxsize=1)
def _household() -> _Household:
    phrases = tuple(phrase.lower() for phrase in all_phrases())
    named = dict.fromkeys(w for p in phrases if len(p.split()) <= HINTS.most_words for w in _words(p))
    names = {letter: tuple(w for w in named if w[0] == letter) for letter in {w[0] for w in named}}
    return _Household(frozenset(phrases), frozenset(w for p in phrases for w in _words(p)), names)
