"""The same runs on a Ray cluster of two workers on this machine, where Ray is installed."""

import importlib.util

import pytest

from langflash_core.batch.cluster import RayWorkers
from langflash_core.errors import InputError, MissingPackageError
from tests.batch.doings import open_copier, tries

HERE = importlib.util.find_spec("ray") is not None
with_ray = pytest.mark.skipif(not HERE, reason="Ray is not installed")


def _crew(count):
    return RayWorkers(open_copier, "local", count, threads=1)


@pytest.mark.skipif(HERE, reason="Ray is installed")
def test_without_ray():
    with pytest.raises(MissingPackageError, match="cluster"):
        _crew(2)


@with_ray
@pytest.mark.filterwarnings("default")
def test_forty_sets_and_a_killed_worker(place):
    photos = {f"s{k:02}": place.add(f"s{k:02}") for k in range(40)}
    photos["s05"].write_text("kill once")
    photos["s11"].write_text("kill")
    photos["s20"].write_text("bad")
    busy = []
    place.run(workers=_crew, tick=lambda workers: busy.append(len(workers.busy)))
    rows = {row.name: row for row in place.ledger()}
    assert max(busy) == 2 and len(rows) == 40
    assert {name for name, row in rows.items() if row.status == "failed"} == {"s11", "s20"}
    assert {name for name, row in rows.items() if row.retried} == {"s05", "s11"}
    assert {name for name, photo in photos.items() if len(tries(photo)) != 1} == {"s05", "s11"}
    for photo in photos.values():
        photo.write_text("well") if photo.read_text() in ("kill", "bad") else None
    again = place.run(workers=_crew)
    assert sorted(row.name for row in again) == ["s11", "s20"]


@with_ray
@pytest.mark.filterwarnings("default")
def test_no_cluster_there():
    with pytest.raises(InputError, match="no Ray cluster at 127"):
        RayWorkers(open_copier, "127.0.0.1:1", 2, threads=1)
