"""What is said of a scene's detail, to people and to programs."""

from dataclasses import replace
from typing import Any

import pytest

from langflash_core.scene.file import load, save
from langflash_core.scene.report import describe, describe_file, detail_line, left_out_line, lens_line
from langflash_core.surface.assemble import assemble
from langflash_core.types import Scene
from tests.scene.plane import wall_prediction
from tests.splat.test_compose import layered

DETAIL = {
    "level": "normal",
    "asked": 118_541,
    "elements": 121_034,
    "coarse": 20_111,
    "fine": 100_923,
    "by_size": {"1": 61_000, "2": 39_923, "4": 15_000, "16": 5_111},
    "photo_size": [756, 588],
    "rounds": 3,
    "photos_psnr_db": [31.23, 30.8],
    "plain_psnr_db": [28.0, 27.9],
}
COUNTS = "121,034 Gaussians (20,111 coarse, 100,923 fine; 1 px 61,000, 2 px 39,923, 4 px 15,000, 16 px 5,111)"
BOUGHT = "from the photos' places 31.2, 30.8 dB"


@pytest.fixture
def scene() -> Scene:
    return assemble(*wall_prediction(width=8, height=6))


def without(*names: str) -> dict[str, Any]:
    return {name: value for name, value in DETAIL.items() if name not in names}


@pytest.mark.parametrize(
    ("detail", "said"),
    [
        (DETAIL, f"normal, {COUNTS} · {BOUGHT} (28.0, 27.9 dB with one Gaussian a pixel)"),
        (without("plain_psnr_db"), f"normal, {COUNTS} · {BOUGHT}"),
        (without("photos_psnr_db"), f"normal, {COUNTS}"),
        (without("level", "by_size", "photos_psnr_db"), "121,034 Gaussians (20,111 coarse, 100,923 fine)"),
        (without("elements", "coarse", "fine", "photos_psnr_db"), f"normal, ({COUNTS.split('; ')[1]}"),
        ({"level": "high"}, "high"),
        ({"photos_psnr_db": 30}, "from the photos' places 30.0 dB"),
        ({"asked": 5, "rounds": 3}, ""),
        ({}, ""),
    ],
)  # fmt: skip
def test_what_people_read(detail, said):
    assert detail_line(detail) == said


@pytest.mark.parametrize("wrong", [None, True, "many", 1.5, [], ["a"], [None], {"1": None}, {"1": "x"}, {}])
@pytest.mark.parametrize("name", sorted(DETAIL))
def test_what_another_version_means_otherwise_is_left_out(name, wrong):
    line = detail_line({**DETAIL, name: wrong})
    if name == "photos_psnr_db":
        assert line.startswith(f"normal, {COUNTS}")
    elif name != "by_size":
        assert "(20,111 coarse, " in line or name in ("coarse", "fine")
    assert "None" not in line and "True" not in line


def test_a_file_keeps_it_and_programs_read_it_whole(scene, tmp_path):
    fine = scene.with_record(detail=DETAIL)
    save(fine, tmp_path / "a.langflash")
    assert load(tmp_path / "a.langflash").record.detail == DETAIL
    assert describe(fine)["detail"] == describe_file(tmp_path / "a.langflash")["detail"] == DETAIL
    assert list(describe_file(tmp_path / "a.langflash")["detail"]["by_size"]) == list(DETAIL["by_size"])


def test_a_scene_without_it_says_nothing(scene, tmp_path):
    save(scene, tmp_path / "a.langflash")
    assert scene.record.detail == {} and describe_file(tmp_path / "a.langflash")["detail"] is None


def test_layers_are_counted_where_there_are_some(tmp_path):
    scene = layered([(2, 0.2, 0), (2, 0.8, 1), (2, 0.5, 1)], [0.0, 0.5, 1.0])
    assert scene.view_ids is not None
    ids = scene.view_ids.clone()
    ids[ids == 1] = -1  # what no photo made is no layer
    for known, count in (
        (scene, 3),
        (replace(scene, view_ids=ids), 2),
        (scene.with_record(layered=False), None),
    ):
        save(known, tmp_path / "a.langflash")
        assert describe(known)["layers"] == describe_file(tmp_path / "a.langflash")["layers"] == count


def test_a_found_lens_is_one_line():
    found = {"fov": 61.23, "error": 0.81, "photos": 8, "said": 65.0, "recorded": False}
    assert lens_line({"found": [found]}) == "61.2 ± 0.8 degrees, found from 8 photos (assumed: 65.0)"
    assert lens_line({}) == lens_line({"found": [{"fov": 1}]}) == lens_line({"found": 3}) == ""


@pytest.mark.parametrize(
    ("shares", "said"),
    [
        ([0, 0, 0.0612], "6 % of photo 3"),
        ([0.3, 0.001, 0], "30 % of photo 1, 1 % of photo 2"),
        ([0.1, 0.2, 0.05, 0.3, 0.4, 0.02], "10 % of photo 1, 20 % of photo 2, 30 % of photo 4, 40 % of photo 5 and some of 2 others"),  # noqa: E501
        ([0.1, 0.2, 0.05, 0.3, 0.4], "10 % of photo 1, 20 % of photo 2, 30 % of photo 4, 40 % of photo 5 and some of another one"),  # noqa: E501
        ([0.0, 0.0], ""),
        ([], ""),
        (["much"], ""),
        (None, ""),
    ],
)  # fmt: skip
def test_what_was_left_out_is_one_line(shares, said):
    assert left_out_line({"shares": shares}) == said
    assert left_out_line({}) == ""


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("sofa.jpg", "a/desk.jpg"), "25 % of a/desk.jpg"),
        (("same.jpg", "same.jpg"), "25 % of photo 2"),
        (("a.jpg", 50 * "b"), "25 % of photo 2"),
        (("a.jpg",), "25 % of photo 2"),
        (("", "b.jpg"), "25 % of photo 2"),
    ],
)
def test_photos_are_called_by_their_names_where_those_tell_them_apart(names, said):
    assert left_out_line({"shares": [0, 0.25]}, names) == said


def test_figures_of_detail_add_up():
    """What was made is not what is there; elements that go on behind others are of no size."""
    assert detail_line(DETAIL, 121_034) == detail_line(DETAIL)
    assert detail_line(DETAIL, 121_000).startswith("normal, 121,034 Gaussians made (20,111 coarse, ")
    behind = detail_line({**DETAIL, "by_size": {"1": 100_923, "4": 20_000}})
    assert "(20,111 coarse, 100,923 fine; 1 px 100,923, 4 px 20,000, behind others 111)" in behind
