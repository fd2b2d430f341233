"""A personal vocabulary: what is kept, what takes it, what is refused."""

import json

import numpy as np
import pytest

from langflash_core.errors import PromptError
from langflash_core.language.lessons import (
    Lesson,
    Lessons,
    fitting,
    lessons_of,
    read_lessons,
    with_lessons,
    write_lessons,
)
from langflash_core.language.settings import LESSON_LIMITS
from langflash_core.types import Record

RNG = np.random.default_rng(0)


def unit(*shape: int) -> np.ndarray:
    rows = RNG.normal(size=shape)
    return (rows / np.linalg.norm(rows, axis=-1, keepdims=True)).astype(np.float32)


def beside(vector: np.ndarray, cosine: float) -> np.ndarray:
    """A unit vector at this cosine of another."""
    other = unit(len(vector))
    other = other - (other @ vector) * vector
    return (cosine * vector + np.sqrt(1 - cosine**2) * other / np.linalg.norm(other)).astype(np.float32)


VECTORS = unit(3, 384)
TAUGHT = Record(atom_names={0: "Grandma's chair"}, atom_denials={2: ("rug", "mat")})


def test_what_was_taught_is_kept_and_what_no_photo_shows_is_not():
    lessons = lessons_of(TAUGHT, VECTORS, "net")
    assert [(one.name, one.denied) for one in lessons.lessons] == [
        ("Grandma's chair", ()),
        ("", ("rug", "mat")),
    ]
    unseen = VECTORS.copy()
    unseen[0] = 0
    assert len(lessons_of(TAUGHT, unseen, "net")) == 1


@pytest.mark.parametrize(
    "cosine, takes", [(LESSON_LIMITS.same + 0.01, True), (LESSON_LIMITS.same - 0.01, False)]
)
def test_a_group_that_looks_so_takes_the_lesson(cosine, takes):
    lessons = lessons_of(TAUGHT, VECTORS, "net")
    rows = np.stack([beside(VECTORS[0], cosine), unit(384)])
    assert list(fitting(rows, "net", lessons)) == ([0] if takes else [])


def test_the_nearest_lesson_is_taken_and_what_was_taught_there_goes_before():
    near = beside(VECTORS[0], 0.95)
    lessons = Lessons("net", (Lesson(near, "stool"), Lesson(VECTORS[0], "chair")))
    assert fitting(VECTORS[:1], "net", lessons)[0].name == "chair"
    assert fitting(VECTORS[:1], "net", lessons, taught=[0]) == {}
    record = with_lessons(
        Record(atom_names={1: "own"}), {0: lessons.lessons[1], 2: Lesson(near, "", ("rug",))}
    )
    assert record.atom_names == {0: "chair", 1: "own"} and record.atom_denials == {2: ("rug",)}


def test_the_same_thing_is_said_anew_and_another_name_is_added():
    old = Lessons("net", (Lesson(VECTORS[0], "chair"), Lesson(VECTORS[1], "lamp")))
    newer = Lessons("net", (Lesson(beside(VECTORS[0], 0.99), "Chair", ("sofa",)),))
    joined = old.joined(newer)
    assert [one.name for one in joined.lessons] == ["lamp", "Chair"]
    other = Lessons("net", (Lesson(beside(VECTORS[0], 0.99), "throne"),))
    assert [one.name for one in old.joined(other).lessons] == ["chair", "lamp", "throne"]


def test_a_file_gives_back_what_was_written(tmp_path):
    lessons, path = lessons_of(TAUGHT, VECTORS, "net"), tmp_path / "mine.words.json"
    write_lessons(lessons, path)
    read = read_lessons(path)
    assert read.network == "net" and len(read) == 2
    for one, same in zip(lessons.lessons, read.lessons, strict=True):
        assert (one.name, one.denied) == (same.name, same.denied) and (one.vector == same.vector).all()


def test_vectors_of_other_weights_are_refused():
    lessons = lessons_of(TAUGHT, VECTORS, "net")
    with pytest.raises(PromptError, match="learn it again"):
        fitting(VECTORS, "another", lessons)
    with pytest.raises(PromptError, match="learn it again"):
        lessons.joined(Lessons("another"))


@pytest.mark.parametrize(
    "change",
    [
        {"version": 2},
        {"format": "langflash prompts"},
        {"lessons": [{"vector": "00"}]},
        {"lessons": [{"vector": np.full(4, np.nan, "<f4").tobytes().hex()}]},
        {"lessons": [{"vector": np.ones(4, "<f4").tobytes().hex()}]},
        {"lessons": [{"vector": unit(4).tobytes().hex(), "name": 3}]},
        {"lessons": [{"vector": unit(4).tobytes().hex()}, {"vector": unit(5).tobytes().hex()}]},
        {"lessons": [{}] * (LESSON_LIMITS.most_lessons + 1)},
        {"network": None},
    ],
)
def test_what_is_no_vocabulary_is_one_sentence(tmp_path, change):
    path = tmp_path / "mine.words.json"
    write_lessons(lessons_of(TAUGHT, VECTORS, "net"), path)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(PromptError, match="no usable vocabulary") as error:
        read_lessons(path)
    assert "\n" not in str(error.value)


def test_too_many_are_refused():
    many = Lessons("net", tuple(Lesson(row) for row in unit(LESSON_LIMITS.most_lessons, 64)))
    with pytest.raises(PromptError, match="at most"):
        many.joined(Lessons("net", (Lesson(unit(64), "one more"),)))
