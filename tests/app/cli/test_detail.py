"""How fine a scene is to be, from the words of a command to `pipeline.reconstruct`."""

from pathlib import Path

import pytest
import torch

from app.cli.places import open_maker
from langflash_core import pipeline
from langflash_core.base.resources import asset_path
from langflash_core.batch.dispatch import Job
from langflash_core.batch.order import Order
from langflash_core.errors import ImageError
from langflash_core.scene.file import save
from tests.app.cli.conftest import stripes

PHOTO = asset_path("photos/books_left.jpg")


@pytest.fixture
def asked(monkeypatch) -> list[tuple]:
    """(detail, gaussians) of every reconstruction that is asked for; none is done."""
    found = []

    def reconstruct(photos, *, detail, gaussians, **others):
        found.append((detail, gaussians))
        raise ImageError("no scene is wanted; this is a test")

    monkeypatch.setattr(pipeline, "reconstruct", reconstruct)
    return found


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ((), ("normal", None)),
        (("--detail", "low"), ("low", None)),
        (("--detail", "high", "--gaussians", 250_000), ("high", 250_000)),
        (("--gaussians", 1_000), ("normal", 1_000)),
    ],
)
def test_reconstruct(run, asked, tmp_path, words, expected):
    assert run("reconstruct", PHOTO, "-o", tmp_path / "a.langflash", *words).code == 2
    assert asked == [expected]


@pytest.mark.parametrize(("detail", "gaussians"), [("normal", None), ("high", 5_000)])
def test_a_worker_of_a_batch(asked, tmp_path, monkeypatch, detail, gaussians):
    monkeypatch.setenv("LP_NUM_THREADS", "1")  # which the worker's beginning would leave behind
    with open_maker(Order(detail=detail, gaussians=gaussians), torch.get_num_threads()) as make:
        made = make(Job("a", (PHOTO,), tmp_path / "a"))
    assert "this is a test" in made.reason and asked == [(detail, gaussians)]


def test_the_words_of_a_batch_are_its_order(done, tmp_path, monkeypatch):
    """The order is what workers get and what the fingerprint is of."""
    orders = []

    def jobs_of(sets, output: Path, order: Order):
        orders.append(order)
        return []

    monkeypatch.setattr("app.cli.commands.batch.jobs_of", jobs_of)
    (tmp_path / "sets" / "a").mkdir(parents=True)
    words = ("batch", tmp_path / "sets", "-o", tmp_path / "out")
    for more in ((), ("--detail", "high"), ("--gaussians", "2000")):
        done(*words, *more)
    assert [(order.detail, order.gaussians) for order in orders] == [
        ("normal", None),
        ("high", None),
        ("normal", 2000),
    ]


def test_info_says_what_it_was_spent_on(run, scene_file, tmp_path):
    detail = {
        "level": "high",
        "elements": 2_352,
        "by_size": {"1": 2_000, "2": 352},
        "photos_psnr_db": [31.2, 30.8],
    }
    fine = tmp_path / "fine.langflash"
    save(stripes().with_record(detail=detail), fine)
    assert run("info", fine, "--json").json()["detail"] == detail
    (line,) = (line for line in run("info", fine).out.splitlines() if line.startswith("detail"))
    assert line == (
        "detail: high, 2,352 Gaussians (1 px 2,000, 2 px 352) · from the photos' places 31.2, 30.8 dB"
    )
    assert run("info", scene_file, "--json").json()["detail"] is None
    assert "detail" not in run("info", scene_file).out
