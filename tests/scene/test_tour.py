"""Tours: what may be in them, that files keep them bit by bit, and what becomes of them as edits."""

import json
from dataclasses import replace

import pytest
import torch

from langflash_core.errors import InputError, SceneFileError
from langflash_core.geometry.poses import (
    FLIGHT,
    STAY,
    Pose,
    Rotation,
    Vector,
    on_tour,
    orbit,
    told_pose,
    tour_seconds,
)
from langflash_core.scene.container import read_container, write_container
from langflash_core.scene.edited import edited_scene, first_marks
from langflash_core.scene.edits import History
from langflash_core.scene.edits_file import load_history, save_history
from langflash_core.scene.file import load, save
from langflash_core.scene.report import describe_file
from langflash_core.scene.settings import TOURS
from langflash_core.scene.tour import NO_TOUR, Note, Stop, Tour, check_tour, read_tour, told_tour
from langflash_core.showing.tours import pose_of_view, stop_at, tour_in, write_tour
from tests.app.cli.conftest import stripes

A, B = Pose(centre=Vector(0.1, -0.2, 0.3), fov=51.0), orbit(Pose(reach=2.0), 0.3, 0.1)
TOUR = Tour(
    (Stop("Door", A, "Come in.", "door"), Stop("Window", B)),
    (
        Note("a chair", Vector(0.1, 0.2, 1.0), phrase="armchair"),
        Note("", Vector(0, 0, 1), Vector(0.3, 0.4, 1)),
    ),
    "Window",
)


def test_what_is_told_is_read_back_also_as_json():
    assert read_tour(told_tour(TOUR)) == TOUR == read_tour(json.loads(json.dumps(told_tour(TOUR))))
    assert told_tour(NO_TOUR) == {} and read_tour({}) == NO_TOUR and not NO_TOUR and TOUR
    assert TOUR.notes[1].length == pytest.approx(0.5) and TOUR.notes[0].length is None


def test_stops_move_are_renamed_and_go_and_the_start_stays_true():
    assert TOUR.moved_stop(1, 0).names == ("Window", "Door") == TOUR.moved_stop(0, 9).names
    assert TOUR.changed_stop(1, name=" The  view ").start == "The view"
    assert TOUR.without_stop(1).start == "" and TOUR.without_stop(0).start == "Window"
    assert TOUR.started("Door").start == "Door" and TOUR.without_note(0).notes == TOUR.notes[1:]
    assert TOUR.with_stop(Stop("Sofa", A), 1).names == ("Door", "Sofa", "Window")
    assert stop_at(TOUR, "2") == stop_at(TOUR, "Window") == 1


@pytest.mark.parametrize(
    ("change", "hint"),
    [
        (lambda: TOUR.with_stop(Stop("Door", B)), "called Door already"),
        (lambda: TOUR.with_stop(Stop("  ", B)), "1 to 60 letters"),
        (lambda: TOUR.with_stop(Stop("x" * 61, B)), "1 to 60 letters"),
        (lambda: TOUR.with_note(Note(" ", Vector(0, 0, 1))), "says nothing"),
        (lambda: TOUR.with_note(Note("x" * 401, Vector(0, 0, 1))), "at most 400"),
        (lambda: TOUR.started("Cellar"), "no stop called Cellar"),
        (
            lambda: check_tour(Tour(tuple(Stop(str(n), A) for n in range(TOURS.most_stops + 1)))),
            "at most 100 stops",
        ),
        (lambda: stop_at(TOUR, "3"), "no stop 3"),
    ],
)
def test_what_cannot_be_is_one_sentence(change, hint):
    with pytest.raises(InputError, match=hint):
        change()


@pytest.mark.parametrize(
    "damage",
    [
        {"stops": 3}, {"stops": [{"name": "a"}]}, {"notes": [{"text": "a", "at": [0, 0]}]}, {"stops": [7]},
        {"notes": [{"text": "a", "at": [0, 0, float("nan")]}]}, {"notes": [{"text": 3, "at": [0, 0, 1]}]},
        {"start": "nowhere"}, {"stops": [{"name": "a", "pose": {**told_pose(A), "fov": 0}}]},
    ],
)  # fmt: skip
def test_damaged_tours_are_refused(damage):
    with pytest.raises(ValueError, match=r"tour|pose"):
        read_tour(damage)


def test_a_file_keeps_its_tour_and_a_file_without_one_stays_as_it_was(tmp_path):
    plain, toured = tmp_path / "plain.langflash", tmp_path / "toured.langflash"
    save(stripes(), plain)
    assert "tour" not in read_container(plain).metadata and tour_in(plain)[0] == NO_TOUR
    save(stripes().with_record(tour=told_tour(TOUR)), toured)
    assert read_tour(load(toured).record.tour) == TOUR == tour_in(toured)[0]
    assert read_container(toured).version == read_container(plain).version, "older programs open it"
    assert describe_file(toured)["tour"] == {"stops": ["Door", "Window"], "notes": 2, "start": "Window"}


def test_another_tour_leaves_all_else_bit_by_bit(tmp_path):
    path, other = tmp_path / "a.langflash", tmp_path / "b.langflash"
    save(stripes(), path)
    content = path.read_bytes()
    write_container(read_container(path), other)
    assert other.read_bytes() == content
    write_tour(TOUR, tour_in(path)[1], path)
    assert tour_in(path)[0] == TOUR
    write_tour(NO_TOUR, tour_in(path)[1], path)
    assert path.read_bytes() == content


def test_a_damaged_tour_damages_the_file(tmp_path):
    path = tmp_path / "a.langflash"
    save(stripes(), path)
    found = read_container(path)
    write_container(replace(found, metadata={**found.metadata, "tour": {"stops": [1]}}), path)
    for read in (load, tour_in, describe_file):
        with pytest.raises(SceneFileError, match=r"a\.langflash is damaged"):
            read(path)


def test_a_tour_is_an_edit_that_is_saved_kept_and_undone(tmp_path):
    scene = stripes()
    history = History(first_marks(scene))
    after = history.edited("Add stop 1", replace(history.marks, tour=told_tour(TOUR)))
    assert after.marks.written != history.marks.written and after.undo().marks == history.marks
    assert read_tour(edited_scene(scene, after.marks).record.tour) == TOUR
    assert first_marks(edited_scene(scene, after.marks)).tour == told_tour(TOUR)
    save_history(after, scene, {}, tmp_path / "edits.json")
    assert load_history(tmp_path / "edits.json", scene) == after
    content = json.loads((tmp_path / "edits.json").read_text())
    content["done"][0]["told"][0][2] = {"stops": [1]}
    (tmp_path / "edits.json").write_text(json.dumps(content))
    with pytest.raises(SceneFileError, match="damaged"):
        load_history(tmp_path / "edits.json", scene)


def test_a_photos_pose_sees_what_the_photo_saw(tmp_path):
    save(stripes(), tmp_path / "a.langflash")
    pose = pose_of_view(tour_in(tmp_path / "a.langflash")[1], 1)
    assert pose.reach == pytest.approx(1.0, abs=0.01) and pose.centre == pytest.approx((0.1, 0, 0))
    torch.testing.assert_close(torch.tensor(pose.rotation), torch.tensor([1.0, 0, 0, 0]))


def test_a_tour_stays_at_its_stops_and_flies_between_them():
    stops = [A, B, Pose(centre=Vector(1, 0, 0), rotation=Rotation(1, 0, 0, 0))]
    assert tour_seconds(3) == 3 * STAY + 2 * FLIGHT
    for number, stop in enumerate(stops):
        begun = number * (STAY + FLIGHT)
        assert on_tour(stops, begun) == on_tour(stops, begun + 0.99 * STAY) == stop
    assert on_tour(stops, 1e9) == stops[2] and on_tour(stops[:1], 77.0) == A
    halfway = on_tour(stops, STAY + FLIGHT / 2)
    assert halfway.centre == pytest.approx([(a + b) / 2 for a, b in zip(A.centre, B.centre, strict=True)])
