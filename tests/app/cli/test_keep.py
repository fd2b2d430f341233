"""`reconstruct --keep`: what is said when it is stopped, and when it goes on."""

import numpy as np
import pytest

from langflash_core import pipeline
from langflash_core.base.keeping import MATCHES, Keep
from langflash_core.base.resources import asset_path
from tests.app.cli.conftest import stripes

PHOTOS = [asset_path("photos/books_left.jpg"), asset_path("photos/books_right.jpg")]


@pytest.fixture
def work(monkeypatch) -> dict[str, bool]:
    """What is done instead of a reconstruction: photos are matched, and it is stopped or comes to its end."""
    does = {"match": True, "stop": True}

    def reconstruct(photos, *, ahead, progress, **others):
        if does["match"]:
            ahead.matched.result()
        progress("network", 0.5)
        ahead.end()
        if does["stop"]:
            raise KeyboardInterrupt
        return stripes()

    monkeypatch.setattr(pipeline, "reconstruct", reconstruct)
    monkeypatch.setattr(
        "langflash_core.cameras.keypoints.match_sources",
        lambda *_: Matched() if does["match"] else stop(),
    )
    return does


class Matched:
    """Matches of nothing."""

    def arrays(self) -> dict[str, np.ndarray]:
        return {"pairs": np.zeros(3)}


def stop():
    raise InterruptedError("nothing was matched; this is a test")


def test_stopped_it_says_where_it_goes_on_and_does(run, done, tmp_path, work):
    kept = tmp_path / "kept"
    words = ("reconstruct", *PHOTOS, "-o", tmp_path / "a.langflash", "--size", 56, "--keep", kept)
    stopped = run(*words)
    assert stopped.code == 130
    said = f"langflash: stopped; progress is saved in {kept}, the same command continues from there\n"
    assert stopped.err == said and len(list(kept.iterdir())) == 1
    work["stop"] = False
    outcome = done(*words)
    assert outcome.err == f"continuing from the progress saved in {kept}\n"
    assert (tmp_path / "a.langflash").is_file() and not kept.exists()
    assert run(*words).err == "", "nothing is left to go on from"


def test_stopped_before_anything_is_kept_it_leaves_no_folder(run, tmp_path, work):
    work["match"] = False
    words = ("reconstruct", *PHOTOS, "-o", tmp_path / "a.langflash", "--size", 56)
    for more in ((), ("--keep", tmp_path / "kept")):
        stopped = run(*words, *more)
        assert stopped.code == 130 and stopped.err == "langflash: stopped; nothing was written\n"
        assert list(tmp_path.iterdir()) == []


def test_steps_of_other_photos_are_not_gone_on_from(done, tmp_path, work):
    kept = tmp_path / "kept"
    Keep.of(kept, {}, [b"another photo"])(MATCHES, Matched().arrays)
    work["stop"] = False
    outcome = done("reconstruct", *PHOTOS, "-o", tmp_path / "a.langflash", "--size", 56, "--keep", kept)
    assert outcome.err == ""
