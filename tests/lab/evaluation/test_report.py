"""Reports: sections of pairs and photos that know the truth, kept work, pages that need nothing else."""

import csv
import io
import json
import re
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from langflash_core.base.colormaps import HEAT_STOPS
from langflash_core.lab.evaluation import bench, labelled, report, report_page
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.drawing import drawn_frame
from langflash_core.lab.evaluation.posed import APART, chosen_triples
from langflash_core.lab.evaluation.report import PUBLISHED, Sources, Workplace, plans
from langflash_core.lab.evaluation.report_parts import Gallery, Plot, Point
from langflash_core.lab.evaluation.report_plot import svg
from langflash_core.lab.evaluation.sharp_subjects import posed_subjects
from langflash_core.lab.evaluation.side_subjects import posed_cases
from langflash_core.lab.evaluation.sights import Sight, heat_picture, label_picture, legend_of
from langflash_core.lab.evaluation.tables import Table, markdown
from langflash_core.lab.photos import PhotoFolder
from langflash_core.network import MINI
from langflash_core.splat import render
from langflash_core.types import Camera, Frame, Scene
from tests.lab.evaluation.real_photos import KnowingNet, knowing, write_folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> PhotoFolder:
    """Its name could be taken for a place to fill in."""
    return write_folder(tmp_path_factory.mktemp("report") / "{kitchen}", 14)


@pytest.fixture
def program(folder: PhotoFolder, monkeypatch) -> list[list[str]]:
    """The network is replaced by the truth; gives the photos of every reconstruction."""
    asked: list[list[str]] = []
    network = KnowingNet(folder)

    def reconstruct(paths, **options):
        ids = [Path(path).stem for path in paths]
        asked.append(ids)
        network.id = ids[0]
        return knowing([folder.photo(id) for id in ids], folder.names, scale=0.25)

    monkeypatch.setitem(labelled.PRESETS, "mini", replace(MINI, native_area=56 * 42))
    monkeypatch.setattr(bench, "reconstruct", reconstruct)
    monkeypatch.setattr(labelled, "load_network", lambda preset, weights: network)
    return asked


def drawn(scene: Scene, camera: Camera) -> Frame:
    """By tiles where there is no language: the reference takes long at eight times the photo's size."""
    return render(scene, camera) if scene.semantics.num_atoms else drawn_frame(scene.gaussians, camera)


def made(folder: PhotoFolder, work: Path) -> list:
    ids = folder.ids[:2]
    place = Workplace(Bench(drawn), work)
    return [judge(place) for judge in plans(Sources(None, None, folder, folder, ids, limit=2))]


def test_a_report_holds_every_number_and_goes_on_where_it_stopped(folder, program, tmp_path):
    found = made(folder, tmp_path)
    assert [section.name for section in found] == ["posed", "sharp_posed", "photos"]
    pairs, sharp_pairs, photos = found
    assert pairs.about.startswith("2 pairs of {kitchen}, ")
    assert photos.about.startswith("2 photos of {kitchen}, ")
    assert pairs.result["measures"]["pose_auc_5"] > 0.99 and pairs.result["scenes"] == 2
    low, high = pairs.intervals["measures/psnr"]
    assert low <= pairs.result["measures"]["psnr"] <= high
    assert photos.result["labels"]["atoms"]["classes_accuracy"] > 0.9
    plain = sharp_pairs.result["measures"]["plain"]
    low, high = sharp_pairs.intervals["measures/plain/photos/psnr"]
    assert low <= plain["photos"]["psnr"] <= high and plain["between"]["seen"] > 0.5
    assert sharp_pairs.tables[0].header == ("measure", "photo through the grid", "plain", "normal")
    assert len(pairs.scenes) == len(sharp_pairs.scenes) == len(photos.scenes) == 2
    assert pairs.scenes[0].worth <= pairs.scenes[1].worth  # failures first
    before = len(program)
    again = made(folder, tmp_path)
    assert len(program) == before  # nothing was reconstructed again
    assert again[0].result == pairs.result and again[0].scenes == pairs.scenes
    made(replace(folder, depth_unit=0.0011), tmp_path)
    assert len(program) > before  # by other depths


def test_rooms_of_a_pack_are_two_sections(folder, program, tmp_path, monkeypatch):
    """Pairs of photos stand for rooms, which would have to be drawn."""
    triples = chosen_triples(folder.ids, 2, APART)
    monkeypatch.setattr(report, "load_pack", lambda path: path)
    monkeypatch.setattr(report, "RoomRenderer", nullcontext)
    monkeypatch.setattr(report, "room_cases", lambda *_, count: posed_cases(folder, triples[:count]))
    monkeypatch.setattr(report, "room_subjects", lambda *_, count: posed_subjects(folder, triples[:count]))
    place = Workplace(Bench(drawn), tmp_path)
    aside, sharp = (judge(place) for judge in plans(Sources(pack=folder.root, limit=2)))
    assert (aside.name, sharp.name) == ("sides", "sharp_rooms")
    assert aside.about.startswith("2 rooms, ") and sharp.about.startswith("2 pairs; ")
    table = markdown(aside.tables)
    assert "| measure | mean of 2 |" in table and "| between the photos | 2 | " in table
    low, high = aside.intervals["by_look/between/psnr"] or (0.0, 0.0)
    assert low <= aside.result["by_look"]["between"]["psnr"] <= high
    assert sharp.tables[0].header == ("measure", "photo through the grid", "plain", "normal")


def test_the_page_needs_nothing_from_elsewhere_and_escapes_what_it_says(folder, program, tmp_path):
    found = made(folder, tmp_path)
    hostile = Table("", ("system",), (("<script>alert(1)</script>",),))
    report = report_page.Report(
        found, hostile, "langflash lab eval report -o 'a & b'", {"cpus": 2}, "mini (abc)", "2026-11-22"
    )
    page = report_page.html(report)
    assert "<script" not in page and "a &amp; b" in page
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)
    assert page.count("<figure>") == 6 and page.count("data:image/jpeg") == 6
    document = json.loads(report_page.document(report))
    psnr = document["sections"]["posed"]["measures"]["psnr"]
    assert psnr == found[0].result["measures"]["psnr"]
    rows = {
        (r["section"], r["measure"]): r for r in csv.DictReader(io.StringIO(report_page.numbers_csv(report)))
    }
    row = rows["posed", "measures/psnr"]
    assert float(row["value"]) == psnr and float(row["low"]) <= psnr <= float(row["high"])
    text = report_page.markdown(report)
    assert f"| PSNR of the photo between, covered pixels (dB) | {psnr:.3f} |" in text
    assert report_page.html(replace(report, published=PUBLISHED)).count("0.7416") == 1


def test_a_plot_holds_its_points_inside():
    points = [
        Point("fast <way>", 0.01, 0.4, (0.3, 0.5)),
        Point("slow way", 2.0, 0.1, None),
        Point("unknown", float("nan"), 0.1),
    ]
    drawn = svg(Plot("Speed", "seconds", "error", points))
    assert "fast &lt;way&gt;" in drawn and "unknown" not in drawn
    places = [tuple(map(float, p)) for p in re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', drawn)]
    assert len(places) == 2
    (fast_x, fast_y), (slow_x, slow_y) = places
    assert 72 <= fast_x < slow_x <= 616 and 18 <= slow_y <= 292 and fast_y < slow_y  # less error is lower
    assert svg(Plot("Nothing", "", "", [])) == ""
    assert "<circle" in svg(Plot("One", "", "", [Point("only", 1.0, 0.0)]))


def test_errors_of_many_sizes_stand_on_a_logarithmic_axis():
    errors = (1e-8, 1e-5, 1e-2)
    drawn = svg(Plot("Speed", "seconds", "error", [Point(str(e), 1.0, e) for e in errors]))
    heights = [float(y) for y in re.findall(r'<circle cx="[\d.]+" cy="([\d.]+)"', drawn)]
    assert heights[0] - heights[1] == pytest.approx(heights[1] - heights[2], abs=0.2)  # written to tenths
    assert len(re.findall('class="grid" x1="72"', drawn)) == 7  # a line a power of ten


def test_errors_below_any_decimal_that_is_written_still_have_an_axis():
    drawn = svg(Plot("Speed", "seconds", "error", [Point(str(e), 1.0, e) for e in (3e-14, 1e-5)]))
    low, high = (float(y) for y in re.findall(r'<circle cx="[\d.]+" cy="([\d.]+)"', drawn))
    assert 18 <= high < low <= 292


def test_a_gallery_shows_the_worst_first_then_the_best(tmp_path):
    gallery = Gallery(tmp_path / "pictures")
    for number in range(6):
        picture = np.full((4, 5, 3), 40 * number, dtype=np.uint8)
        gallery.add(Sight(str(number), f"scene {number}", {"a": picture, "b": picture}, {"n": 1.0}, number))
    gallery.add(Sight("7", "nothing judged", {"a": picture}, {"n": float("nan")}, float("nan")))
    keys = [str(n) for n in range(9)]
    assert [s.name for s in gallery.shown(keys, 2, 1)] == ["scene 0", "nothing judged", "scene 5"]
    assert len(gallery.shown(keys, 6, 2)) == 7


def test_pictures_say_what_is_unknown():
    labels = np.array([[0, 1], [-1, 1]])
    picture = label_picture(labels)
    assert (picture[0, 1] == picture[1, 1]).all() and not (picture[0, 0] == picture[0, 1]).all()
    assert picture[1, 0].tolist() == [38, 38, 42]
    assert list(legend_of(("a", "b", "c"), labels)) == ["a", "b"]
    ends = np.round(255 * np.array([HEAT_STOPS[0], HEAT_STOPS[-1]])).astype(int)
    assert np.abs(heat_picture(np.array([[0.0, 1.0]]))[0].astype(int) - ends).max() <= 1  # rounding
