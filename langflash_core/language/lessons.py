"""What people taught one scene, for other scenes: a personal vocabulary.

A lesson is how a group looks, a vector v (`langflash_core/appearance.py`), with the name that a person gave
the group and the words that it is not. In another scene the groups that look so, cos(a, v) >=
`LESSON_LIMITS.same`, take the lesson of the nearest v, as if that person had taught them there (`taught`);
what was taught in a scene itself goes before.

Source: own; `LESSON_LIMITS.same` is measured on real rooms (MEASURED.md, "What is taught in one room").
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from langflash_core.base.files import readable_file, write_atomically
from langflash_core.base.limits import TEXT
from langflash_core.base.records import Record
from langflash_core.errors import PromptError
from langflash_core.language.settings import LESSON_LIMITS

SUFFIX = ".words.json"
FORMAT, VERSION = "langflash words", 1


@dataclass(frozen=True)
class Lesson:
    """vector: unit, how the group looks. name: "" where it has none. denied: what it is not."""

    vector: Float[np.ndarray, " C"]
    name: str = ""
    denied: tuple[str, ...] = ()


@dataclass(frozen=True)
class Lessons:
    """Of each thing one, the newest last. network: which one looked, a digest."""

    network: str
    lessons: tuple[Lesson, ...] = ()

    def __len__(self) -> int:
        return len(self.lessons)

    def joined(self, newer: "Lessons") -> "Lessons":
        """With what was taught since: the same thing under the same name, or under none, is said anew.

        Raises:
            PromptError: two networks looked, or there are too many together.
        """
        _check_network(self.network, newer.network)
        kept = [old for old in self.lessons if not any(_replaces(new, old) for new in newer.lessons)]
        if len(kept) + len(newer.lessons) > LESSON_LIMITS.most_lessons:
            raise PromptError(
                f"a vocabulary holds at most {LESSON_LIMITS.most_lessons:,} groups; begin another one"
            )
        return Lessons(self.network, (*kept, *newer.lessons))


def lessons_of(record: Record, rows: Float[np.ndarray, "K C"], network: str) -> Lessons:
    """What a person taught a scene.

    Args:
        rows: how its atoms look; what no photo shows, a row of 0, cannot be told from anything. network: that
            looked.
    """
    taught = sorted({*record.atom_names, *record.atom_denials} - {*record.lone_atoms})
    lessons = (
        Lesson(rows[k].astype(np.float32), record.atom_names.get(k, ""), record.atom_denials.get(k, ()))
        for k in taught
        if rows[k].any()
    )
    return Lessons(network, tuple(lessons))


def fitting(
    rows: Float[np.ndarray, "K C"], network: str, lessons: Lessons, taught: Iterable[int] = ()
) -> dict[int, Lesson]:
    """The lesson of each atom that has one; `taught`: atoms that a person taught in this scene.

    Raises:
        PromptError: another network looked.
    """
    _check_network(lessons.network, network)
    if not lessons.lessons:
        return {}
    vectors = np.stack([one.vector for one in lessons.lessons]).astype(np.float64)
    cosines = rows.astype(np.float64) @ vectors.T  # (K, L)
    places, own = cosines.argmax(1), set(taught)
    fits = [k for k in range(len(rows)) if cosines[k, places[k]] >= LESSON_LIMITS.same and k not in own]
    return {k: lessons.lessons[int(places[k])] for k in fits}


def with_lessons(record: Record, taken: Mapping[int, Lesson]) -> Record:
    """A record in which atoms have taken lessons."""
    names = {k: one.name for k, one in taken.items() if one.name}
    denials = {k: one.denied for k, one in taken.items() if one.denied}
    return replace(
        record,
        atom_names={**record.atom_names, **names},
        atom_denials={**record.atom_denials, **denials},
    )


def write_lessons(lessons: Lessons, path: Path) -> None:
    """Write a vocabulary; whole or not at all.

    Raises:
        OutputError: the place cannot be written.
    """
    rows = [
        {
            "name": one.name,
            "denied": list(one.denied),
            "vector": one.vector.astype("<f4").tobytes().hex(),
        }
        for one in lessons.lessons
    ]
    document = {"format": FORMAT, "version": VERSION, "network": lessons.network, "lessons": rows}
    text = json.dumps(document, indent=1, ensure_ascii=False) + "\n"
    write_atomically(path, text.encode("utf-8", "replace"))


def read_lessons(path: Path) -> Lessons:
    """Read what `write_lessons` wrote.

    Raises:
        PromptError: there is no such file, or it holds no usable vocabulary; says what is wrong.
    """
    readable_file(path, "vocabulary", PromptError)
    TEXT.check(path.stat().st_size, path.name, PromptError)
    try:
        return _parse(json.loads(path.read_bytes()))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        why = " ".join(str(error).split())[:120]
        raise PromptError(
            f"{path.name} is no usable vocabulary ({why}); make one with `langflash words learn`"
        ) from error


def _parse(document: Any) -> Lessons:
    if document["format"] != FORMAT or document["version"] != VERSION:
        raise ValueError(f"expected format {FORMAT!r}, version {VERSION}")
    rows, network = document["lessons"], document["network"]
    if not isinstance(network, str) or not isinstance(rows, list) or len(rows) > LESSON_LIMITS.most_lessons:
        raise ValueError(f"expected a network and at most {LESSON_LIMITS.most_lessons} lessons")
    lessons = tuple(_lesson(row) for row in rows)
    if len({len(one.vector) for one in lessons}) > 1:
        raise ValueError("expected vectors of one length")
    return Lessons(network, lessons)


def _lesson(row: Any) -> Lesson:
    vector = np.frombuffer(bytes.fromhex(row["vector"]), "<f4").astype(np.float32)
    length = float(np.linalg.norm(vector.astype(np.float64)))
    if not np.isfinite(length) or abs(length - 1) > 1e-3:  # float32 numbers that were normalised: 1e-6
        raise ValueError("expected unit vectors")
    denied = row.get("denied", [])
    if not isinstance(denied, list) or len(denied) > LESSON_LIMITS.most_denied:
        raise ValueError(f"expected at most {LESSON_LIMITS.most_denied} denied words")
    return Lesson(vector, _word(row.get("name", "")), tuple(map(_word, denied)))


def _word(text: Any) -> str:
    if not isinstance(text, str) or len(text) > LESSON_LIMITS.longest:
        raise ValueError(f"expected words of at most {LESSON_LIMITS.longest} characters")
    return text.strip()


def _replaces(new: Lesson, old: Lesson) -> bool:
    alike = float(new.vector.astype(np.float64) @ old.vector) >= LESSON_LIMITS.same
    return alike and (not old.name or not new.name or new.name.lower() == old.name.lower())


def _check_network(ours: str, theirs: str) -> None:
    if ours != theirs:
        raise PromptError(
            "the vocabulary was learned with other weights, whose numbers mean other things; learn it again "
            "from the scenes that were taught"
        )
