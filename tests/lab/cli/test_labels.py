"""`langflash lab labels`: a folder of clips, each once, with our own network alone."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.cli import main
from langflash_core.base.resources import asset_path
from langflash_core.batch.summary import THUMBNAIL
from langflash_core.lab.labels.making import REPORT
from langflash_core.lab.labels.storage import LABELS, read_labels
from tests.lab.photos import layouts_made
from tests.torture.jobs import in_this_process


def write_clip(folder: Path, name: str, frames: int = 3) -> None:
    """A window that slides along a shipped photo."""
    folder.mkdir(parents=True)
    with Image.open(asset_path(f"photos/{name}_left.png")) as opened:
        photo = opened.convert("RGB").resize((200, 140))
    for t in range(frames):
        photo.crop((6 * t, 0, 6 * t + 168, 126)).save(folder / f"{t:03d}.png")


@pytest.fixture(scope="module")
def clips(tmp_path_factory) -> Path:
    source = tmp_path_factory.mktemp("labels") / "clips"
    write_clip(source / "desk", "desk")
    write_clip(source / "toy" / "images", "toy", 2)
    write_clip(source / "broken", "toy", 2)
    (source / "broken" / "001.png").write_bytes(b"no picture")
    return source


@pytest.fixture(scope="module")
def made(clips: Path) -> Path:
    out = clips.parent / "out"
    assert main(["lab", "labels", str(clips), "-o", str(out)]) == 1  # one of them is broken
    return out


def test_every_clip_gets_labels_a_report_and_a_row(made):
    rows = {row["name"]: row for row in csv.DictReader((made / "ledger.csv").read_text().splitlines())}
    assert {name: row["status"] for name, row in rows.items()} == {
        "broken": "failed", "desk": "done", "toy": "done",
    }  # fmt: skip
    for name, frames in (("desk", 3), ("toy", 2)):
        labels = read_labels(made / name / LABELS)
        assert labels.ids.shape == (frames, 126, 168) and labels.vectors.shape[1] == 384
        assert len(labels.objects) == int(rows[name]["groups"]) > 1
        assert labels.coverage.min() > 0.5
        page = (made / name / REPORT).read_text()
        assert page.count("<figure>") == frames and (made / name / THUMBNAIL).is_file()
    assert "001.png" in rows["broken"]["reason"] and not (made / "broken").exists()


def test_an_object_of_a_sliding_window_keeps_its_number(made):
    ids = read_labels(made / "desk" / LABELS).ids
    both = (ids[0][:, 6:] > 0) & (ids[1][:, :-6] > 0)
    # Nearest values and flow to a fraction of a pixel move borders; inside, numbers are the same.
    assert (ids[0][:, 6:] == ids[1][:, :-6])[both].mean() > 0.9


@pytest.mark.slow
def test_what_is_done_is_not_done_again_and_what_changed_is(made, clips, tmp_path, capsys):
    clips, made = (shutil.copytree(each, tmp_path / each.name) for each in (clips, made))
    before = {name: (made / name / LABELS).stat().st_mtime_ns for name in ("desk", "toy")}
    assert main(["lab", "labels", str(clips), "-o", str(made), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["done_before"] == 2
    assert before == {name: (made / name / LABELS).stat().st_mtime_ns for name in before}
    write_clip(clips / "toy2" / "images", "toy", 2)
    Image.fromarray(np.zeros((126, 168, 3), np.uint8)).save(clips / "toy" / "images" / "001.png")
    main(["lab", "labels", str(clips), "-o", str(made), "--workers", "1", "--json"])
    assert json.loads(capsys.readouterr().out)["done"] == 3
    after = {name: (made / name / LABELS).stat().st_mtime_ns for name in before}
    assert after["desk"] == before["desk"] and after["toy"] > before["toy"]


@pytest.mark.slow
def test_chunks_that_were_enriched_are_not_labelled_again(tmp_path, capsys):
    layouts_made.re10k_split(layouts_made.wall(tmp_path / "photos", 2), tmp_path / "re10k")
    split, out = tmp_path / "re10k" / "test", tmp_path / "out"
    command = ["lab", "labels", str(split), "-o", str(out), "--enrich", "--json"]
    assert main(command) == 0
    first = json.loads(capsys.readouterr().out)
    assert (first["done_before"], first["enriched"]) == (0, 2)
    written = (split / "000000.torch").stat().st_mtime_ns
    assert main(command) == 0
    assert json.loads(capsys.readouterr().out)["done_before"] == 2
    assert (split / "000000.torch").stat().st_mtime_ns == written
    assert main(["lab", "labels", str(split), "-o", str(tmp_path / "back"), "--extract"]) == 0
    for key in ("aaaa", "bbbb"):
        old, new = (read_labels(folder / key / LABELS).ids for folder in (out, tmp_path / "back"))
        assert np.array_equal(old, new)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--masks", "mobile-sam"], "needs weights"),
        (["--masks", "mobile-sam", "--weights", "gone.pt"], "no checkpoint of MobileSAM"),
        (["--follow", "sam2"], "add --masks sam2"),
        (["--side", "500"], "multiple of 64"),
        (["--enrich"], "no index.json"),
        (["--extract"], "no index.json"),
    ],
)
def test_what_cannot_be_is_one_sentence_and_nothing_is_written(clips, tmp_path, capsys, options, sentence):
    assert main(["lab", "labels", str(clips), "-o", str(tmp_path / "out"), *options]) == 2
    assert sentence in capsys.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize("options", [(), ("--workers", "1")])
def test_why_one_clip_failed_is_said_once(clips, tmp_path, capsys, options):
    """A table of workers says it in its row."""
    with in_this_process():
        words = ["lab", "labels", str(clips / "broken"), "-o", str(tmp_path / "out"), *options]
        assert main(words) == 1
    assert capsys.readouterr().err.count("001.png") == 1


def test_frames_are_not_written_over(clips, capsys):
    assert main(["lab", "labels", str(clips), "-o", str(clips)]) == 2
    assert "choose another -o" in capsys.readouterr().err
