"""rooms, train, eval: words in, files out; what they compute is tested where it lives."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image
from safetensors.torch import save_file

from app.cli.lab.words.training import LAYOUTS
from langflash_core.lab.photos import layouts
from langflash_core.lab.photos.writing import FolderWriter
from langflash_core.lab.training.shards import Label, open_shards, write_shard
from langflash_core.network import MINI, GuidedDepthNet, load_network, save_network
from langflash_core.network.semantics.mobile_sam.model import MobileSam
from tests.lab.evaluation.real_photos import write_folder
from tests.lab.rooms.conftest import TINY_PACK
from tests.lab.training.conftest import toy_record
from tests.network.published import mobile_sam_file

PLAIN = np.tile(np.linspace(120, 136, 56).astype(np.uint8)[None, :, None], (42, 1, 3))
"""A photo of a shade: something is to be seen, and there is no corner to match."""


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    torch.manual_seed(0)
    path = tmp_path_factory.mktemp("weights") / "drawn.safetensors"
    network = GuidedDepthNet(MINI)
    network.begin_halves()
    save_network(network, path)
    return path


def test_rooms_preview(run, tmp_path):
    path = tmp_path / "new" / "sheet.png"
    outcome = run("lab", "rooms", "preview", TINY_PACK, "-o", path, "--count", "1", "--held-out")
    assert outcome.code == 0, outcome.err
    assert np.asarray(Image.open(path)).std() > 10  # something was drawn


def test_rooms_render(run, tmp_path):
    words = ("--count", "2", "--seed", "3", "--views", "3", "--size", "70x56", "--held-out")
    outcome = run("lab", "rooms", "render", TINY_PACK, "-o", tmp_path / "rooms", *words)
    assert outcome.code == 0, outcome.err
    files = sorted((tmp_path / "rooms").iterdir())
    assert [path.name for path in files] == ["room_00000003.npz", "room_00000004.npz"]
    assert np.load(files[0])["images"].shape == (3, 56, 70, 3)


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ("lab rooms pack gone -o p.npz", "there is no folder gone"),
        ("lab rooms preview gone.npz -o a.png", "no furniture pack at gone.npz"),
        ("lab rooms render gone.npz -o out", "no furniture pack at gone.npz"),
        ("lab rooms render TINY_PACK -o out --count 0", "--count"),
        ("lab train cache gone.npz -o out", "no furniture pack at gone.npz"),
        ("lab train cache TINY_PACK -o out --start gone", "no weights file at gone"),
        ("lab train cache TINY_PACK -o out --part 2/2", "--part"),
        ("lab train adopt gone gone -o w.safetensors", "no encoder checkpoint at gone"),
        ("lab train run gone -o out --stages depth --minutes 1", "there is no folder gone"),
        ("lab train run gone -o out --stages depth --minutes 0", "--minutes"),
        ("lab train run . -o out", "either --stages with --minutes, or a --recipe"),
        ("lab train run . -o out --stages depth", "either --stages with --minutes"),
        ("lab train run . -o out --recipe paper --minutes 1", "either --stages with --minutes"),
        ("lab train run . -o out --recipe gone", "there is no recipe 'gone'; choose paper"),
        ("lab train run . -o out --recipe paper --batches 2", "says itself"),
        ("lab train run . -o out --stages taste --minutes 1", "no stage 'taste'"),
        (
            "lab train run . -o out --stages depth --minutes 1 --sam-teacher TINY_PACK",
            "no stage here regresses SAM's embedding; name grouping",
        ),
        ("lab train parts gone", "there is no folder gone"),
        ("lab train parts . --run gone", "there is no folder gone"),
        ("lab train export gone -o w.safetensors", "there is no folder gone"),
        ("lab eval rooms gone", "there is no folder gone"),
        ("lab eval calibrate gone", "there is no folder gone"),
        ("lab eval sides", "give either a furniture pack or a folder with --posed"),
        ("lab eval sides p.npz --posed .", "not both"),
        ("lab eval sides gone.npz", "no furniture pack at gone.npz"),
        ("lab eval sides p.npz --size 224", "leave --size out"),
        ("lab eval sides p.npz --lpips gone", "no LPIPS file at gone"),
        ("lab eval sides p.npz --lpips TINY_PACK", "is no safetensors file"),
        ("lab eval beside gone gone", "gone holds no result of eval sides or walk"),
        ("lab eval walk", "give either a furniture pack or a folder with --posed"),
        ("lab eval walk p.npz --posed .", "not both"),
        ("lab eval walk gone.npz", "no furniture pack at gone.npz"),
        ("lab eval walk p.npz --photos 1", "two photos or more"),
        ("lab eval walk --posed . --passers 1", "leave them out with --posed"),
        ("lab eval walk p.npz --sheet a.png", "give --results, too"),
        ("lab eval walk p.npz -o table.txt", "this command writes .md"),
        ("lab eval sharp a.png --pack p.npz", "give photos, a folder with --posed, or furniture"),
        ("lab eval sharp gone.png gone.png", "no photo at gone.png"),
        ("lab eval sharp TINY_PACK", "photos come in pairs, but these are 1"),
        ("lab eval sharp .", "holds no photos NAME_left and NAME_right"),
        ("lab eval sharp --pack gone.npz", "no furniture pack at gone.npz"),
        ("lab eval sharp --detail none", "--detail"),
        ("lab eval sharp --beside gone", "there is no folder gone; make it with --keep"),
        ("lab eval sharp --lpips gone", "no LPIPS file at gone"),
        ("lab eval sharp -o table.txt", "this command writes .md"),
        ("lab eval walk p.npz --sheet sheet.jpg", "this command writes .png; rename --sheet"),
        ("lab eval walk p.npz --results TINY_PACK", "is not a folder; choose another --results"),
        ("lab eval sharp --weights gone", "no checkpoint at gone"),
        ("weights verify gone", "no checkpoint at gone"),
        ("weights", "ACTION"),
    ],
)
def test_bad_input(run, tmp_path, monkeypatch, words, hint):
    monkeypatch.chdir(tmp_path)
    outcome = run(*(TINY_PACK if word == "TINY_PACK" else word for word in words.split()))
    assert outcome.code == 2 and hint in outcome.err and outcome.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_train_needs_what_a_stage_reads(run, checkpoint, tmp_path):
    (tmp_path / "cache").mkdir()
    words = ("--stages", "depth", "--minutes", "1", "--start", checkpoint)
    outcome = run("lab", "train", "run", tmp_path / "cache", "-o", tmp_path / "run", *words)
    assert outcome.code == 2 and outcome.err.count("\n") == 1  # an empty cache


def test_train_export_of_nothing(run, checkpoint, tmp_path):
    (tmp_path / "run").mkdir()
    card = tmp_path / "card.json"
    words = ("lab", "train", "export", tmp_path / "run", "-o", tmp_path / "w.safetensors")
    words = (*words, "--start", checkpoint)
    assert "no trained stage" in run(*words).err
    card.write_text("[]")
    assert "one JSON object" in run(*words, "--metadata", card).err
    assert not (tmp_path / "w.safetensors").exists()


@pytest.fixture
def photos(tmp_path):
    """Two labelled photos of a wall with a chair on it."""
    writer = FolderWriter(tmp_path / "photos")
    for id in ("1", "2"):
        writer.photo(id, PLAIN)
        labels = np.ones((42, 56), np.int64)
        labels[10:30, 10:40] = 2
        writer.labels(id, labels)
    writer.finish({1: ("wall", None), 2: ("chair", None)}, "drawn by a test")
    return tmp_path / "photos"


def more(photos):
    """Six photos of the two."""
    for number in range(3, 7):
        for folder in ("images", "labels"):
            content = next((photos / folder).glob("1.*"))
            (photos / folder / f"{number}{content.suffix}").write_bytes(content.read_bytes())


def moved(before, after):
    """The parts of a network that differ between two files."""
    states = [load_network("mini", path).state_dict() for path in (before, after)]
    return {key.split(".")[0] for key in states[0] if not torch.equal(*(state[key] for state in states))}


def test_photos_are_cached(run, checkpoint, photos, tmp_path):
    words = ("--photos", photos, "-o", tmp_path / "cache", "--start", checkpoint, "--copies", "2")
    outcome = run("lab", "train", "cache", *words)
    assert outcome.code == 0 and "4 new views" in outcome.out, outcome.err
    assert "0 new views" in run("lab", "train", "cache", *words).out
    (shard,) = (tmp_path / "cache" / "photos" / "train").iterdir()
    assert open_shards(shard.parent)[0].record(0).labels[0].name == "wall"


def test_the_late_half_is_trained_and_exported(run, checkpoint, photos, tmp_path):
    """Two steps on six photos and two rooms; what comes out is a network whose late halves have moved."""
    more(photos)
    rooms = [toy_record(seed) for seed in (0, 1)]
    write_shard(tmp_path / "cache" / "train" / "a.safetensors", rooms)
    steps = ["--minutes", "5", "--max-steps", "2", "--pictures", "3", "--start"]
    words = ("--photos", photos, *steps, checkpoint)
    outcome = run("lab", "train", "late", tmp_path / "cache", "-o", tmp_path / "run", *words)
    assert outcome.code == 0 and "2 steps" in outcome.out, outcome.err
    out = tmp_path / "w.safetensors"
    assert run("lab", "train", "export", tmp_path / "run", "-o", out, "--start", checkpoint).code == 0
    assert moved(checkpoint, out) == {"late", "deep", "language_head", "decoder", "depth_head"}


def test_the_late_half_goes_on_with_other_photos(run, checkpoint, photos, tmp_path):
    """The same photos once more without a label beside them; `late` is what later stages read."""
    more(photos)
    write_shard(tmp_path / "cache" / "train" / "a.safetensors", [toy_record(0)])
    assert run("lab", "train", "photos", "plain", photos / "images", "-o", tmp_path / "plain").code == 0
    steps = ["--minutes", "5", "--max-steps", "1", "--pictures", "2"]
    words = ("--photos", photos, "--more", tmp_path / "plain", *steps)
    where = ("-o", tmp_path / "run", "--start", checkpoint)
    outcome = run("lab", "train", "late", tmp_path / "cache", *words, *where)
    assert outcome.code == 0 and "1 steps" in outcome.out, outcome.err
    assert {path.name for path in (tmp_path / "run").glob("*.pt")} == {"late.pt", "late_few.pt"}
    words = ("--photos", photos, "--more", tmp_path / "gone", "--minutes", "5")
    assert "gone/images" in run("lab", "train", "late", tmp_path / "cache", *words, *where).err


def test_other_networks_are_learned_to_be_read(run, checkpoint, photos, tmp_path):
    """Two steps on six photos and a room; the layer that reads them moves, and nothing else."""
    write_shard(tmp_path / "cache" / "train" / "a.safetensors", [toy_record(0)])
    few = ("--photos", photos, "-o", tmp_path / "few", "--minutes", "1", "--start", checkpoint)
    assert "no name that 5 of them show" in run("lab", "train", "second", tmp_path / "cache", *few).err
    more(photos)
    words = ("--photos", photos, "-o", tmp_path / "run", "--minutes", "5", "--max-steps", "2")
    outcome = run("lab", "train", "second", tmp_path / "cache", *words, "--start", checkpoint)
    assert outcome.code == 0 and "2 steps" in outcome.out, outcome.err
    out = tmp_path / "w.safetensors"
    assert run("lab", "train", "export", tmp_path / "run", "-o", out, "--start", checkpoint).code == 0
    assert moved(checkpoint, out) == {"second_head"}
    blind = GuidedDepthNet(MINI)
    for value in blind.others.parameters():
        torch.nn.init.zeros_(value)
    save_network(blind, tmp_path / "blind.safetensors")
    words = ("lab", "train", "second", tmp_path / "cache", *words)
    refused = run(*words, "--start", tmp_path / "blind.safetensors")
    assert refused.code == 2 and "holds no other networks; give both with --weights" in refused.err


def test_the_grouping_learns_from_named_and_outlined_photos(run, checkpoint, photos, tmp_path):
    """Three things at once: the outlines of a network that finds nothing, a step on photos of two kinds, and
    how well groups follow names."""
    torch.manual_seed(0)
    save_file(mobile_sam_file(MobileSam(128).eval()), tmp_path / "sam.safetensors")
    out = tmp_path / "outlined"
    words = ("--weights", tmp_path / "sam.safetensors", "--side", "128", "--grid", "2")
    outcome = run("lab", "train", "outlines", photos, "-o", out, *words)
    assert outcome.code == 0 and "2 photos outlined" in outcome.out, outcome.err
    assert np.asarray(Image.open(out / "labels" / "1.png")).shape == (42, 56)
    write_shard(tmp_path / "cache" / "train" / "a.safetensors", [toy_record(0)])
    words = ("--stages", "grouping", "--minutes", "5", "--max-steps", "1", "--start", checkpoint)
    where = (tmp_path / "cache", "-o", tmp_path / "run", "--outlined", photos, out, "--workers", "1")
    outcome = run("lab", "train", "run", *where, *words, "--pictures", "4", "--rate", "1e-4")
    assert outcome.code == 0 and "trained grouping" in outcome.out, outcome.err
    (row,) = [json.loads(line) for line in (tmp_path / "run" / "grouping.jsonl").read_text().splitlines()][:1]
    assert "photos_contrast" in row and row["rate"] <= 1e-4
    words = ("lab", "eval", "grouping", photos, "--weights", checkpoint)
    outcome = run(*words, "--limit", "1", "--json")
    assert outcome.code == 0 and 0 < outcome.json()["parts"]["achievable"] <= 1, outcome.err
    assert "| F1 of borders, 4 pixels |" in run(*words).out


def test_a_data_set_is_converted(run, tmp_path):
    (tmp_path / "seq").mkdir()
    Image.new("RGB", (56, 42)).save(tmp_path / "seq" / "frame-000000.color.png")
    np.savetxt(tmp_path / "seq" / "frame-000000.pose.txt", np.eye(4))
    outcome = run("lab", "train", "photos", "frames", tmp_path / "seq", "-o", tmp_path / "out")
    assert outcome.code == 0 and outcome.out == f"{tmp_path / 'out'}: 1 photos\n", outcome.err
    assert tuple(layouts.LAYOUTS) == LAYOUTS


def test_labelled_photos_are_judged(run, checkpoint, photos, tmp_path):
    table = tmp_path / "new" / "table.md"
    words = ("--weights", checkpoint, "--limit", "1", "--size", "56", "--backend", "torch", "-o", table)
    outcome = run("lab", "eval", "photos-labelled", photos, *words, "--json")
    assert outcome.code == 0, outcome.err
    document = outcome.json()
    assert document["photos"] == 1 and document["numbers"] == ["2", "2"]
    assert set(document["labels"]) == {"atoms", "features"}
    assert "| 37 classes: mIoU |" in table.read_text()


def test_posed_photos_are_judged(run, checkpoint, tmp_path):
    """Three equal photos of a shade without a corner: no motion is true, none matches and one is left out,
    whose direction is then the worst; and there is no depth to judge."""
    writer = FolderWriter(tmp_path / "posed")
    for id in ("0", "3", "6"):
        writer.photo(id, PLAIN)
        writer.pose(id, torch.eye(4, dtype=torch.float64))
    writer.finish({}, "drawn by a test")
    words = ("--weights", checkpoint, "--size", "56", "--backend", "torch", "--apart", "6")
    outcome = run("lab", "eval", "posed", tmp_path / "posed", *words)
    assert outcome.code == 0, outcome.err
    assert "(no motion)" in outcome.out and "| 6 | 1.000 | 0.000 | 0.000 | 0.000 | 180.000 |" in outcome.out
    assert "Depth" not in outcome.out


@pytest.mark.slow
def test_rooms_are_judged_from_aside(run, checkpoint):
    """A scene of the network's own size, by an untrained network."""
    outcome = run("lab", "eval", "sides", TINY_PACK, "--weights", checkpoint, "--limit", "1")
    assert outcome.code == 0, outcome.err
    assert "| the photos' own places | 1 |" in outcome.out


def test_posed_photos_are_judged_from_aside(run, checkpoint, tmp_path):
    posed = write_folder(tmp_path / "posed", 7).root
    words = ("--weights", checkpoint, "--size", "56", "--backend", "torch", "--apart", "6")
    outcome = run("lab", "eval", "sides", "--posed", posed, *words, "--results", tmp_path / "now", "--json")
    assert outcome.code == 0, outcome.err
    (row,) = outcome.json()["cases"]
    assert row["name"] == "001-007" and {"001", "004"} <= row["looks"].keys()
    table = tmp_path / "new" / "table.md"
    beside = run("lab", "eval", "beside", tmp_path / "now", tmp_path / "now", "-o", table)
    assert beside.code == 0 and beside.out == table.read_text()
    assert "| between the photos: PSNR, holes black (dB) |" in beside.out and "+0.000 |" in beside.out
    without = run("lab", "eval", "beside", tmp_path / "now", tmp_path / "now", "--sheet", tmp_path / "a.png")
    assert without.code == 2 and "keeps no pictures" in without.err
    for depths in (posed / "depths").iterdir():
        depths.unlink()
    assert "has no depth in metres" in run("lab", "eval", "sides", "--posed", posed, *words).err


def test_a_walk_is_judged_kept_and_judged_beside_itself(run, checkpoint, tmp_path):
    posed = write_folder(tmp_path / "posed", 5).root
    sheet, kept = tmp_path / "new" / "sheet.png", tmp_path / "kept"
    words = ["--size", "56", "--photos", "2", "3", "--kept", "1", "--limit", "1", "--results"]
    words = ("lab", "eval", "walk", "--posed", posed, "--weights", checkpoint, *words, kept)
    outcome = run(*words, "--sheet", sheet, "--json")
    assert outcome.code == 0, outcome.err
    document = outcome.json()
    assert document == json.loads((kept / "walk.json").read_text())
    (row,) = document["cases"]
    assert row["name"] == "001-005" and list(row["photos"]) == ["2", "3"]
    assert row["photos"]["3"]["gaussians"] > 0 and row["photos"]["3"]["frames"]["3"]["alone_psnr"] > 5
    pictures = {path.stem.split("_")[-1] for path in (kept / "pictures").iterdir()}
    assert pictures == {"truth", "2", "3", "own two"}
    assert np.asarray(Image.open(sheet)).std() > 10
    # Gone on from: nothing is left to do, even without the photos.
    for photo in (posed / "images").iterdir():
        photo.write_bytes(b"")
    assert "| PSNR between, whole (dB) |" in run(*words).out
    table, both = tmp_path / "new" / "table.md", tmp_path / "both.png"
    beside = run("lab", "eval", "beside", kept, kept, "-o", table, "--sheet", both)
    assert beside.code == 0 and beside.out == table.read_text()
    assert "| 3 photos: PSNR between, whole (dB) |" in beside.out and "+0.00 |" in beside.out
    assert np.asarray(Image.open(both)).shape[1] > np.asarray(Image.open(sheet)).shape[1]


@pytest.mark.parametrize(
    ("words", "hint"),
    [
        ("lab eval sides --posed PHOTOS", "has no poses.txt"),
        ("lab eval walk --posed PHOTOS", "has no poses.txt"),
        ("lab eval sharp --posed PHOTOS", "has no poses.txt"),
        ("lab eval photos-labelled gone", "there is no folder gone/images"),
        ("lab eval photos-labelled PHOTOS --only 7-9", "none of the 2 photos is chosen"),
        ("lab eval photos-labelled PHOTOS --part validation", "choose another --part or --only"),
        ("lab eval photos-labelled PHOTOS --only 9-7", "--only"),
        ("lab eval photos-labelled PHOTOS --crop 9,9,3,3", "--crop"),
        ("lab eval photos-labelled PHOTOS --crop 0,0,99,9", "does not fit into photo 1"),
        ("lab eval photos-labelled PHOTOS -o table.txt", "this command writes .md"),
        ("lab eval posed PHOTOS", "has no poses.txt"),
        ("lab eval calibrate . --plot plot.jpg", "this command writes .png; rename --plot"),
        ("lab train cache -o out", "either a furniture pack or a folder with --photos"),
        ("lab train cache p.npz --photos PHOTOS -o out", "not both"),
        ("lab train cache --photos PHOTOS -o out --set held_out", "no held-out set"),
        ("lab train late gone --photos PHOTOS -o out --minutes 1", "no folder gone"),
        ("lab train late . --photos gone -o out --minutes 1", "no folder gone/images"),
        ("lab train late . -o out --minutes 1", "--photos"),
        ("lab train second gone --photos PHOTOS -o out --minutes 1", "no folder gone"),
        (
            "lab train second . --photos PHOTOS -o out --minutes 1 --weights gone.tflite gone2.tflite",
            "gone.tflite",
        ),
        ("lab train late . --photos PHOTOS -o out --minutes 1", "langflash lab train cache"),
        ("lab train late . --photos PHOTOS -o out --minutes 1 --names", "--names goes with --more"),
        ("lab train photos nyu gone -o out", "there is no gone"),
        ("lab train outlines PHOTOS -o out --weights gone.pt", "no checkpoint of MobileSAM"),
        ("lab train outlines PHOTOS -o out", "--weights"),
        ("lab eval grouping gone", "there is no folder gone/images"),
        ("lab train run . -o o --scenes . --outlined PHOTOS", "leave out --outlined"),
        (
            "lab train run . -o o --stages depth --minutes 1 --outlined PHOTOS",
            "no stage here learns from outlined photos",
        ),
        ("lab train run . -o o --recipe paper --rate 1", "what --rate is"),
        ("lab train photos voc gone -o out", "invalid choice"),
    ],
)
def test_bad_photos(run, photos, tmp_path, monkeypatch, words, hint):
    place = tmp_path / "here"
    place.mkdir()
    monkeypatch.chdir(place)
    outcome = run(*(str(photos) if word == "PHOTOS" else word for word in words.split()))
    assert outcome.code == 2 and hint in outcome.err and outcome.err.count("\n") == 1
    assert not list(place.iterdir())


def test_rooms_and_photos_are_calibrated_together(run, checkpoint, tmp_path):
    """Sixteen photos of a wall, every second with a toilet; the fourth and the eleventh are validation."""
    writer = FolderWriter(tmp_path / "photos")
    for number in range(0, 32, 2):
        id = str(number)
        writer.photo(id, np.random.default_rng(number).integers(0, 255, (42, 56, 3), dtype=np.uint8))
        labels = np.ones((42, 56), np.int64)
        labels[10:30, 10:40] = 1 + number // 2 % 2
        writer.labels(id, labels)
    writer.finish({1: ("wall", None), 2: ("toilet", None)}, "drawn by a test")
    rooms = [replace(toy_record(seed), tokens=None, token_scales=None) for seed in (0, 1)]
    rooms[1] = replace(rooms[1], labels=tuple(Label(g, g) for g in ("lamp", "rug", "bed", "bath")))
    write_shard(tmp_path / "cache" / "validation" / "a.safetensors", rooms)
    plot = tmp_path / "new" / "diagram.png"
    words = ("--weights", checkpoint, "--photos", tmp_path / "photos", "--backend", "torch", "--plot", plot)
    outcome = run("lab", "eval", "calibrate", tmp_path / "cache", *words)
    assert outcome.code == 0, outcome.err
    found = outcome.json()["calibration"]
    assert 0 < found["threshold"] < 1 and set(found["validation"]) == {"rooms", "photos"}
    assert found["validation"]["photos"]["phrases"] == 2  # one photo shows both names, so nothing is absent
    assert np.asarray(Image.open(plot)).std() > 10
