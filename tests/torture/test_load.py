"""A little of what `python -m tests.torture load` does much of."""

import resource
import sys
from pathlib import Path

import pytest

from langflash_core.base import memory
from langflash_core.base.memory import free_memory
from langflash_core.errors import SceneFileError
from langflash_core.export import stored
from tests.torture import large, load

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="/proc")


def test_questions_leave_nothing_behind(context):
    row = load.many_questions(60)
    # What memory does in 60 questions says little; nothing else may grow.
    assert not [find for find in row.finds if "memory" not in find], row


def test_many_atoms_and_phrases_are_answered(context):
    assert load.many_atoms(80, 20).finds == []


def test_what_does_not_fit_into_memory_is_refused_before_the_work(monkeypatch):
    monkeypatch.setattr(memory, "free_memory", lambda: 10**9)
    with pytest.raises(SceneFileError, match=r"10,000,000 .* take 1\.1 GB to open, and 1\.0 GB are"):
        stored.Gathering(10_000_000, 1, "a.splat")
    stored.Gathering(1000, 1, "a.splat")
    monkeypatch.setattr(memory, "free_memory", lambda: None)  # where the system does not say
    stored.Gathering(1000, 1, "a.splat")


def test_a_limit_to_this_process_is_known():
    free, before = free_memory(), resource.getrlimit(resource.RLIMIT_DATA)
    used = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_DATA, (used + (50 << 20), before[1]))
    try:
        limited = free_memory()
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)
    assert free is not None and limited is not None and 30 << 20 < limited <= 50 << 20 < free


def test_a_large_scene_is_opened_or_refused_in_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(large, "MEMORY", 900 << 20)
    path = tmp_path / "large.splat"
    large.write_splat(path, 100_000)
    row = large.large_scene(path, 100_000)
    assert row.finds == [] and row.told.startswith("100,000 Gaussians"), row
    monkeypatch.setenv("LANGFLASH_MOST_GAUSSIANS", "1000")
    row = large.large_scene(path, 100_000)
    assert row.finds == [] and "more than 1,000" in row.told
