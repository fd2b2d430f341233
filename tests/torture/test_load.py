"""A little of what `python -m tests.torture load` does much of."""

import sys

import pytest

from tests.torture import load

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="/proc")


def test_questions_leave_nothing_behind(context):
    row = load.many_questions(60)
    # What memory does in 60 questions says little; nothing else may grow.
    assert not [find for find in row.finds if "memory" not in find], row


def test_many_atoms_and_phrases_are_answered(context):
    assert load.many_atoms(80, 20).finds == []


def test_a_large_scene_is_opened_or_refused_in_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(load, "MEMORY", 900 << 20)
    row = load.large_scene(tmp_path, 100_000)
    assert row.finds == [] and row.told.startswith("100,000 Gaussians"), row
    monkeypatch.setenv("LANGFLASH_MOST_GAUSSIANS", "1000")
    row = load.large_scene(tmp_path, 1001)
    assert row.finds == [] and "more than 1,000" in row.told
