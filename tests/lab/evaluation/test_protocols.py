"""Protocols on tiny data sets in the published layouts: the truth scores as the truth, through the program's
own drawing; whole networks with random weights go from end to end."""

import json
from pathlib import Path

import pytest

from app.cli.lab.words.judging import EVAL_PROTOCOLS
from langflash_core.errors import InputError
from langflash_core.lab.evaluation import bench
from langflash_core.lab.evaluation.bench import Bench
from langflash_core.lab.evaluation.cases import Judge, case_tallies, cases_markdown, result_of
from langflash_core.lab.evaluation.protocols import PROTOCOLS, planned, scannet_views
from langflash_core.lab.photos import PhotoFolder
from langflash_core.language.spaces import language_space
from langflash_core.splat import render
from tests.lab.evaluation.real_photos import knowing
from tests.lab.photos import layouts_made as made


@pytest.fixture(scope="module")
def wall(tmp_path_factory) -> PhotoFolder:
    return made.wall(tmp_path_factory.mktemp("wall") / "photos", 6)


@pytest.fixture(scope="module")
def data(wall: PhotoFolder, tmp_path_factory) -> dict[str, Path]:
    root = tmp_path_factory.mktemp("published")
    made.scannet_table(root / "scannet")
    for scene in ("scene0700_00", "scene0701_00"):
        made.lsm_scene(wall, root / "scannet" / scene)
    chosen = {"scene0700_00": [0, 20, 40, 60, 80, 100], "scene0701_00": [0, 20, 40]}
    (root / "scannet" / "selected_seqs_test.json").write_text(json.dumps(chosen))
    made.re10k_split(wall, root / "re10k")
    made.masked_scene(wall, root / "3dovs" / "bed")
    made.frames(made.wall(root / "long", 26), root / "7scenes" / "seq-01")
    return {name: root / name for name in PROTOCOLS}


@pytest.fixture
def truth(wall: PhotoFolder, monkeypatch):
    """The network is replaced by what knows the wall: the scene of the photos that look like those given."""

    def reconstruct(paths, **options):
        ids = [path.stem for path in paths]
        places = [int(id) // 20 if len(ids[0]) < 4 else int(id) for id in ids]
        return knowing([wall.photo(wall.ids[place]) for place in places], wall.names, scale=0.25)

    monkeypatch.setattr(bench, "reconstruct", reconstruct)


def judge() -> Judge:
    return Judge(Bench(render), language_space("minilm"))


def test_every_protocol_can_be_named_on_the_command_line():
    assert set(EVAL_PROTOCOLS) == {*PROTOCOLS, "nyu"}


def test_scannet_takes_targets_between_their_neighbours():
    assert scannet_views(30)[:3] == [(0, 1, 2), (3, 4, 5), (8, 9, 10)]
    assert len(scannet_views(30)) == 8
    assert scannet_views(5) == [(0, 1, 2)], "the last frame has no neighbour behind it"
    assert scannet_views(1) == []


def test_the_truth_of_scannet_scores_as_the_truth(data, truth, tmp_path):
    plan = planned("scannet", data["scannet"])
    tallies = case_tallies(judge(), plan.cases)
    assert plan.count == len(tallies) == 3
    result = result_of(tallies, draws=20)
    assert result["scenes"] == 2 and result["cases"] == 3
    atoms, measures = result["labels"]["atoms"], result["measures"]
    # A desk counts as other, but the word is nearest to "chair": all of it is lost, a tenth of the picture.
    assert atoms["target_accuracy"] > 0.85 and atoms["source_accuracy"] > 0.85
    # Half the photo's size and soft splats cost a pixel around each thing.
    assert atoms["target_iou_floor"] > 0.9 and atoms["target_iou_wall"] > 0.85
    assert atoms["source_iou_other"] == 0 and atoms["source_iou_sofa"] is None
    assert measures["pose_auc_5"] > 0.99 and measures["depth_abs_rel"] < 1e-2
    assert measures["psnr_whole_picture"] > 18 and measures["label_consistency"] > 0.9
    assert measures["psnr"] > measures["psnr_first_photo"] + 3
    table = cases_markdown("scannet", result)
    assert "mIoU 0.7416, accuracy 0.8718" in table and f"| {atoms['target_accuracy']:.3f} " in table


def test_the_truth_of_realestate10k_is_placed_by_the_cameras_alone(data, truth):
    tallies = case_tallies(judge(), planned("re10k", data["re10k"]).cases)
    result = result_of(tallies, draws=5)
    assert result["cases"] == 1 and result["labels"] == {}
    measures = result["measures"]
    assert "depth_abs_rel" not in measures and measures["pose_auc_5"] > 0.99
    assert measures["psnr"] > measures["psnr_first_photo"] + 3 and len(tallies[0][1].numbers["psnr"]) == 3


def test_3d_ovs_asks_each_scene_for_its_own_names(data, truth, monkeypatch, wall):
    def reconstruct(paths, **options):
        return knowing([wall.photo(wall.ids[int(path.stem)]) for path in paths], wall.names, scale=0.25)

    monkeypatch.setattr(bench, "reconstruct", reconstruct)
    cases = list(planned("3dovs", data["3dovs"]).cases)
    assert [case.photos for case in cases] == [("00", "03"), ("03", "00")]
    assert cases[0].labels == ("chair", "desk", "floor", "wall")
    result = result_of(case_tallies(judge(), cases), draws=5)
    assert result["labels"]["atoms"]["source_miou"] > 0.85  # a pixel around each thing, as above
    assert result["measures"]["presence_recall"] > 0.9


def test_7_scenes_gives_pairs_with_a_frame_between(data):
    cases = list(planned("7scenes", data["7scenes"]).cases)
    assert cases[0].photos == ("000000", "000006") and cases[0].targets == ("000003",)
    assert {int(c.photos[1]) - int(c.photos[0]) for c in cases} == {6, 12, 18, 24}


def test_labels_permuted_are_wrong(data, truth, wall, monkeypatch):
    def reconstruct(paths, **options):
        swapped = {**wall.names, 1: wall.names[2], 2: wall.names[1]}
        places = [int(path.stem) // 20 for path in paths]
        return knowing([wall.photo(wall.ids[place]) for place in places], swapped, scale=0.25)

    monkeypatch.setattr(bench, "reconstruct", reconstruct)
    result = result_of(case_tallies(judge(), planned("scannet", data["scannet"]).cases), draws=5)
    assert result["labels"]["atoms"]["source_accuracy"] < 0.3
    assert result["labels"]["atoms"]["source_iou_wall"] < 0.05


@pytest.mark.parametrize("name", sorted(PROTOCOLS))
def test_an_absent_data_set_is_one_sentence_that_says_how_to_get_it(name: str, tmp_path: Path):
    with pytest.raises(InputError) as absent:
        planned(name, tmp_path / "nothing")
    assert PROTOCOLS[name].get in str(absent.value)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError):
        list(planned(name, tmp_path / "empty").cases)


def test_nothing_to_judge_is_said():
    with pytest.raises(InputError, match="nothing to judge"):
        case_tallies(judge(), [])
    with pytest.raises(InputError, match="no protocol"):
        planned("kitti", Path())
