"""Runs by real processes whose work is to copy a word: what is done, again, lost, stopped."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from langflash_core.batch.order import Order
from langflash_core.batch.processes import LocalWorkers
from langflash_core.batch.run import SCENE, fingerprint
from langflash_core.batch.sets import SUMMARY
from tests.batch.conftest import Place
from tests.batch.doings import open_copier, tries

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def _statuses(rows):
    return {row.name: row.status for row in rows}


def test_every_set_once_and_never_more_than_the_workers(place):
    photos = [place.add(f"s{k:02}") for k in range(12)]
    most = []
    rows = place.run(count=3, tick=lambda workers: most.append(len(workers.busy)))
    assert len(rows) == 12 and max(most) == 3
    workers = [tries(photo) for photo in photos]
    assert all(len(each) == 1 for each in workers)
    assert len({number for each in workers for number in each}) <= 3  # each does many
    assert [row.name for row in place.ledger()] == [f"s{k:02}" for k in range(12)]
    row = place.ledger()[0]
    assert (row.gaussians, row.found, row.photos, row.warnings) == (7, "1/1", 1, "a | b, <i>")
    assert all((place.output / row.name / SCENE).read_text() == "well" for row in rows)


def test_what_was_there_before_a_failure_stays(place):
    photo = place.add("a")
    place.run()
    photo.write_text("bad")
    (row,) = place.run()
    assert row.status == "failed" and row.reason.endswith("what lies in its folder is from before")
    assert (place.output / "a" / SCENE).read_text() == "well"


def test_only_what_is_left_or_has_changed_is_done(place):
    names = ("a", "b", "c", "d", "e")
    photos = {name: place.add(name) for name in names}
    photos["e"].write_text("bad")
    place.run()
    assert place.run() and {name: len(tries(photos[name])) for name in names} == {
        **dict.fromkeys(names, 1),
        "e": 2,  # what failed is tried again
    }
    photos["a"].write_text("other")
    (place.source / "b" / "more.jpg").touch()
    (place.output / "c" / SCENE).unlink()
    photos["e"].write_text("well")
    before = (place.output / "d" / SCENE).stat().st_mtime_ns
    assert sorted(row.name for row in place.run()) == ["a", "b", "c", "e"]
    assert (place.output / "a" / SCENE).read_text() == "other"
    assert (place.output / "d" / SCENE).stat().st_mtime_ns == before
    assert len(place.ledger()) == 5 and place.run() == []


def test_other_options_are_other_work(place):
    place.add("a")
    place.run()
    place.order = Order(prompts=("plant",))
    assert len(place.run()) == 1
    place.order = Order(prompts=("plant",), detail="low")
    assert len(place.run()) == 1 and place.run() == []


def test_the_fingerprint_is_of_photos_and_options(place, tmp_path):
    photo = place.add("a")
    first = fingerprint([photo], Order())
    others = [Order(size=112), Order(prompts=("b",)), Order(exports=(".ply",)), Order(weights=photo)]
    others += [Order(detail="high"), Order(gaussians=5000)]
    assert len({first, *(fingerprint([photo], order) for order in others)}) == 7
    place.source.rename(tmp_path / "moved")
    assert fingerprint([tmp_path / "moved" / "a" / "a.jpg"], Order()) == first
    assert fingerprint([photo], Order()) != first  # it is gone


def test_a_killed_worker_loses_its_set_only(place):
    photos = {name: place.add(name) for name in ("a", "b", "c", "d", "e")}
    photos["b"].write_text("kill once")
    photos["d"].write_text("kill")
    place.run()
    rows = {row.name: row for row in place.ledger()}
    assert _statuses(rows.values()) == {**dict.fromkeys("abce", "done"), "d": "failed"}
    assert {name: row.retried for name, row in rows.items()} == {"a": 0, "b": 1, "c": 0, "d": 1, "e": 0}
    assert "signal 9" in rows["d"].reason
    assert len(set(tries(photos["b"]))) == 2  # in a fresh worker
    assert {name: len(tries(photo)) for name, photo in photos.items()} == {
        "a": 1,
        "b": 2,
        "c": 1,
        "d": 2,
        "e": 1,
    }
    # What the killed ones had begun to write is swept up.
    assert sorted(os.listdir(place.output)) == ["a", "b", "c", "e", "ledger.csv", SUMMARY]


def test_forty_sets_by_two_of_whom_one_is_killed_are_what_one_makes(place, tmp_path):
    photos = {f"s{k:02}": place.add(f"s{k:02}", f"photo {k}") for k in range(40)}
    photos["s20"].write_text("bad")
    alone = Place(place.source, tmp_path / "alone")
    alone.run(count=1)
    killed = []

    def tick(workers):
        if len(place.ledger()) >= 10 and not killed:
            number = next(iter(workers._processes.values())).pid
            os.kill(number, signal.SIGKILL)
            killed.append(number)

    place.run(tick=tick)
    assert killed and _statuses(place.ledger()) == _statuses(alone.ledger())
    assert [row.name for row in place.ledger() if row.status == "failed"] == ["s20"]
    done = [name for name in photos if name != "s20"]
    assert all((place.output / n / SCENE).read_text() == (alone.output / n / SCENE).read_text() for n in done)
    assert sum(row.retried for row in place.ledger()) <= 1
    again = {name: len(tries(photo)) for name, photo in photos.items()}  # one alone, one by two
    assert sum(again.values()) <= 2 * 40 + 1
    place.run()
    alone.run()
    assert {name for name, photo in photos.items() if len(tries(photo)) > again[name]} == {"s20"}


def test_a_worker_that_was_killed_while_idle_is_replaced(place):
    for name in ("a", "b"):
        place.add(name)
    killed = []

    def tick(workers):
        if not workers.busy and not killed:
            for process in workers._processes.values():
                process.kill()
                process.join()
                killed.append(process.pid)

    crew = LocalWorkers(open_copier, 1)
    place.run(workers=lambda _: crew, tick=tick)
    assert _statuses(place.ledger()) == {"a": "done", "b": "done"}


def test_stopped_in_the_middle(place):
    photos = [place.add("a"), place.add("b", "slow"), place.add("c", "slow")]

    def tick(workers):
        if len(workers.busy) == 2 and all(tries(photo) for photo in photos[1:]):
            raise KeyboardInterrupt

    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        place.run(tick=tick)
    assert time.monotonic() - start < 20  # nobody waits for the slow ones
    assert _statuses(place.ledger()) == {"a": "done"}
    assert sorted(os.listdir(place.output)) == ["a", "ledger.csv", SUMMARY]
    for photo in photos[1:]:
        photo.write_text("well")
    assert sorted(row.name for row in place.run()) == ["b", "c"]
    assert len(tries(photos[0])) == 1


def test_the_run_itself_killed(place):
    """Kill it with one set done and two under way: the next run does those, and sweeps up."""
    photos = [place.add("a"), place.add("b", "slow"), place.add("c", "slow")]
    code = (
        "import sys; from pathlib import Path; from tests.batch.conftest import Place\n"
        "if __name__ == '__main__': Place(Path(sys.argv[1]), Path(sys.argv[2])).run()"
    )
    run = subprocess.Popen([sys.executable, "-c", code, place.source, place.output], start_new_session=True)
    patience = time.monotonic() + 60
    while not all(tries(photo) for photo in photos) and time.monotonic() < patience:
        time.sleep(0.05)
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    assert _statuses(place.ledger()) == {"a": "done"}
    for photo in photos[1:]:
        photo.write_text("well")
    assert sorted(row.name for row in place.run()) == ["b", "c"]
    assert [len(tries(photo)) for photo in photos] == [1, 2, 2]
    assert sorted(os.listdir(place.output)) == ["a", "b", "c", "ledger.csv", SUMMARY]


def test_workers_outside_the_main_thread(place):
    """Only the main thread may say what becomes of signals."""
    place.add("a")
    thread = threading.Thread(target=place.run)
    thread.start()
    thread.join(60)
    assert _statuses(place.ledger()) == {"a": "done"}
