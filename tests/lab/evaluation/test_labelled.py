"""Single labelled photos: the truth scores as the truth, mistakes cost what they should."""

from dataclasses import replace
from pathlib import Path

import pytest
import torch

from langflash_core.errors import InputError
from langflash_core.lab.evaluation import bench, labelled
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.calibration import photos_asked
from langflash_core.lab.evaluation.leads import learned_leads
from langflash_core.lab.evaluation.photo_words import PhotoWords, absent_rows, paper_row, photos_of_names
from langflash_core.lab.evaluation.tables import markdown
from langflash_core.lab.evaluation.tallies import Shelf
from langflash_core.lab.evaluation.words import PAPER_LABELS
from langflash_core.lab.photos import Name, PhotoFolder
from langflash_core.language.settings import RIVALS
from langflash_core.language.spaces import language_space
from langflash_core.network import MINI
from langflash_core.splat import render
from tests.lab.evaluation.real_photos import KnowingNet, knowing, write_folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> PhotoFolder:
    return write_folder(tmp_path_factory.mktemp("real") / "photos", 10)


@pytest.fixture
def program(folder: PhotoFolder, monkeypatch):
    """Instead of the network: scenes and features that know the truth. Names are asked from one photo on."""
    net = KnowingNet(folder)

    def reconstruct(paths, **options):
        net.id = Path(paths[0]).stem
        return knowing([folder.photo(net.id)], folder.names)

    monkeypatch.setattr(bench, "reconstruct", reconstruct)
    monkeypatch.setattr(labelled, "load_network", lambda preset, weights: net)
    monkeypatch.setattr("langflash_core.lab.evaluation.photo_words.FINE_PHOTOS", 1)
    monkeypatch.setattr("langflash_core.lab.evaluation.photo_words.ASKED_PHOTOS", 1)
    monkeypatch.setitem(labelled.PRESETS, "mini", replace(MINI, native_area=56 * 42))
    return net


def test_the_truth_scores_as_the_truth(folder: PhotoFolder, program):
    result, tally = labelled.run_photos(folder, folder.ids[2:5], Bench(render))
    measures, atoms = result["measures"], result["labels"]["atoms"]
    assert result["photos"] == 3 and measures["covered"] > 0.98
    assert measures["depth_abs_rel"] < 1e-3 and measures["depth_delta1"] == 1
    assert measures["border_f1"] > 0.9 and measures["right_elsewhere"] > 0.95  # drawn at twice the size
    assert measures["large_classes_miou"] > 0.7 and measures["right_near_borders"] > 0.7
    assert measures["depth_scale"] == pytest.approx(1, abs=1e-3)  # network_unit makes metres of it
    assert measures["presence_recall"] == 1 and measures["presence_precision"] > 0.9
    for row in result["labels"].values():  # borders blend, or are cut coarsely
        assert row["classes_accuracy"] > 0.9 and row["fine_accuracy"] > 0.9 and row["paper_accuracy"] > 0.9
    assert atoms["classes_miou"] > 0.75  # of five things at 56 x 42 pixels, two of them small
    assert {row["name"] for row in result["names"]} == {"wall", "floor", "chair", "desk", "lamp"}
    assert all(row["iou"] > 0.8 for row in result["names"])
    asked = {row["name"]: row["photos"] for row in result["names"]}
    assert asked["lamp"] == 1 and asked["chair"] == 3
    masks = {row["name"]: row["masks"] for row in result["masks"]}
    assert masks == {"wall": 3, "floor": 3, "chair": 3, "desk": 3, "lamp": 1} and measures["masks"] == 13
    assert measures["masks_right_atoms"] == measures["mask_names_right_features"] == 1
    # Photo 004 shows everything that may be asked, so nothing is absent from it.
    assert len(tally.scores) == 2 and all(t.float().mean() == 0.5 for t in tally.truths)


def test_what_is_kept_is_not_even_decoded(folder: PhotoFolder, program, tmp_path, monkeypatch):
    def judged() -> dict:
        shelf = Shelf(tmp_path, {}, labelled.Tally)
        return labelled.run_photos(folder, folder.ids[2:4], Bench(render), shelf=shelf)[0]

    result = judged()
    monkeypatch.setattr(PhotoFolder, "photo", lambda *_: pytest.fail("decoded"))
    assert judged() == result


def test_a_calibration_asks_what_a_run_asks(folder: PhotoFolder, program):
    found = photos_asked(folder, folder.ids[2:5], Bench(render))
    _, tally = labelled.run_photos(folder, folder.ids[2:5], Bench(render))
    assert torch.equal(found.scores, torch.cat(tally.scores)) and len(found.scores) > 0
    assert torch.equal(found.truths, torch.cat(tally.truths))
    assert torch.equal(found.ious, torch.stack(tally.ious)) and len(found.ious) == int(found.truths.sum())


def test_tables_say_what_the_result_says(folder: PhotoFolder, program):
    result, _ = labelled.run_photos(folder, folder.ids[3:4], Bench(render))
    table = markdown(labelled.tables(result))
    measures = result["measures"]
    flat = f"{measures['depth_abs_rel_flat']:.3f} (one depth)"
    assert f"| Depth AbsRel, scale aligned | {measures['depth_abs_rel']:.3f} | {flat} |" in table
    assert f"mean of {len(result['names'])}" in table and "| lamp | 1 |" in table
    assert "| the program: atoms drawn |" in table and "8 labels, desks are other" in table


def test_pixels_without_a_scene_are_wrong(folder: PhotoFolder, program):
    """Half of the Gaussians vanish: the names there have no answer, and the depth there is not judged."""
    judged = labelled.Judged.of(folder, Bench(render))
    photo = folder.photo("004")
    drawn, _ = labelled.draw_photo(judged, photo)
    half = drawn.maps.clone()
    half[:, :, : half.shape[2] // 2] = 0
    alphas = drawn.frame.alphas.clone()
    alphas[:, : half.shape[2] // 2] = 0
    cut = replace(drawn, maps=half, frame=replace(drawn.frame, alphas=alphas))
    whole, part = labelled.Tally(), labelled.Tally()
    labelled.judge_names(judged, drawn, whole)
    labelled.judge_names(judged, cut, part)
    counts = part.counts["atoms", "classes"]
    assert int(counts[:, -1].sum()) > 0.4 * int(counts.sum())
    assert labelled.accuracy(counts) < 0.6 * labelled.accuracy(whole.counts["atoms", "classes"])
    assert torch.equal(part.counts["features", "classes"], whole.counts["features", "classes"])
    labelled.judge_depth(cut, True, part)
    assert part.numbers["depth_abs_rel"][0] < 1e-3


def test_a_wrong_name_costs_what_it_covers(folder: PhotoFolder, program, monkeypatch):
    """Chairs and desks change their names: both are wrong, walls and floors are not."""
    swapped = {**folder.names, 3: folder.names[4], 4: folder.names[3]}

    def reconstruct(paths, **options):
        return knowing([folder.photo(Path(paths[0]).stem)], swapped)

    monkeypatch.setattr(bench, "reconstruct", reconstruct)
    result, _ = labelled.run_photos(folder, ("002",), Bench(render))
    ious = result["class_ious"]["atoms"]
    assert ious["wall"] > 0.9 and ious["chair"] < 0.05 and ious["desk"] < 0.05
    papers = result["paper_ious"]["atoms"]
    assert papers["chair"] < 0.05 and papers["table"] < 0.05  # a desk is a table
    masks = {row["name"]: (row["atoms"], row["features"]) for row in result["masks"]}
    assert masks == {"wall": (1, 1), "floor": (1, 1), "chair": (0, 1), "desk": (0, 1)}


def test_depth_knows_no_unit_and_a_folder_needs_no_labels(folder: PhotoFolder, program, monkeypatch):
    monkeypatch.setattr(
        bench,
        "reconstruct",
        lambda paths, **options: knowing([folder.photo(Path(paths[0]).stem)], folder.names, scale=3.0),
    )
    judged = labelled.Judged.of(folder, Bench(render))
    tally = labelled.judge(judged, replace(folder.photo("001"), labels=None, metric=False))
    assert tally.numbers["depth_abs_rel"][0] < 1e-3 and "depth_abs_rel_metric" not in tally.numbers
    assert not tally.counts and not tally.scores
    result = labelled.summary(tally, judged.words)
    assert result["labels"] == {} and "presence_recall" not in result["measures"]
    assert "depth" in markdown(labelled.tables(result)).lower()


def test_names_are_counted_by_photos_that_show_them(folder: PhotoFolder):
    counts = photos_of_names(folder, folder.ids)
    assert counts == {"wall": 10, "floor": 10, "chair": 10, "desk": 10, "lamp": 1}


def test_rows_of_the_paper():
    table = PAPER_LABELS.index("table")
    assert paper_row("table") == paper_row("desk") == paper_row("night stand") == table
    assert paper_row("other furniture", "coffee table") == table
    assert (
        paper_row("desk", published=True) == paper_row(None) == paper_row("picture") == len(PAPER_LABELS) - 1
    )
    assert paper_row("sofa") == paper_row("sofa", published=True) == PAPER_LABELS.index("sofa")


def test_words_of_a_folder():
    names = {1: Name("wall", "wall"), 5: Name("yeti", None), 7: Name("wall", "wall")}
    words = PhotoWords.of(names, {"wall": 40, "yeti": 9})
    assert words.fine == ("wall",) and words.asked == words.every == ("wall", "yeti")
    assert words.classes_of.tolist() == [-1, 0, -1, -1, -1, -1, -1, 0]
    assert words.asked_of[5] == 1 and words.fine_of[5] == -1 and words.papers[5] == len(PAPER_LABELS) - 1
    assert words.rows(("wall", "yeti")) == [0, len(words.phrases) - 1]


def test_what_is_absent_means_something_else():
    asked = ("book", "bookcase", "chair", "garden gnome", "couch", "seat")
    vectors = language_space("minilm").encode(asked)
    generator = torch.Generator().manual_seed(0)
    rows = absent_rows(["books", "sofa"], asked, vectors, 9, generator)
    # "book" is there, a couch is a sofa, a sofa is a seat.
    assert {asked[row] for row in rows} == {"bookcase", "chair", "garden gnome"}
    assert len(absent_rows(["books"], asked, vectors, 1, generator)) == 1


def test_leads_are_learned_of_what_some_photos_show_and_others_do_not(folder: PhotoFolder, program):
    """Of these the lamp alone, and one border tells nothing of other words."""
    leads = learned_leads(folder, folder.ids[2:5], Bench(render))
    told = leads.of(language_space().encode(["wall", "lamp"]))
    assert told.tolist() == pytest.approx([RIVALS.lead] * 2)
    with pytest.raises(InputError, match="give more labelled photos"):
        learned_leads(folder, [folder.ids[4]], Bench(render))  # it shows everything that may be asked
