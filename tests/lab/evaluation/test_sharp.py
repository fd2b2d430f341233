"""Scenes beside their photos at the photos' size: what is drawn where, columns, tables."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core.errors import InputError, SceneFileError
from langflash_core.lab.evaluation import bench
from langflash_core.lab.evaluation.drawing import drawn_frame
from langflash_core.lab.evaluation.posed import Triple
from langflash_core.lab.evaluation.sharp import PLAIN, Bench, judge, paired, run_sharp, tables
from langflash_core.lab.evaluation.sharp_subjects import (
    pair_subjects,
    posed_subjects,
    room_subjects,
    sharp_size,
)
from langflash_core.lab.evaluation.tables import difference, markdown
from langflash_core.lab.photos import PhotoFolder
from langflash_core.lab.rooms import RoomRenderer, load_pack
from langflash_core.surface.settings import LAYERS
from langflash_core.types import Camera, Frame, Scene
from tests.lab.evaluation.real_photos import knowing, write_folder
from tests.lab.rooms.conftest import TINY_PACK

TRIPLES = [Triple("001", "004", "007", 6), Triple("002", "008", "014", 12)]


def render(scene: Scene, camera: Camera) -> Frame:
    """By tiles: the reference takes ten times as long at eight times the photo's size."""
    return drawn_frame(scene.gaussians, camera)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> PhotoFolder:
    return write_folder(tmp_path_factory.mktemp("sharp") / "photos", 14)


@pytest.fixture
def program(folder: PhotoFolder, monkeypatch):
    """The network is replaced by the truth, changed by what `program.change` is set to."""

    class Program:
        change = staticmethod(lambda scene: scene)

        def __call__(self, paths, **options):
            return self.change(knowing([folder.photo(Path(p).stem) for p in paths], folder.names, scale=0.25))

    made = Program()
    monkeypatch.setattr(bench, "reconstruct", made)
    return made


def judged(folder: PhotoFolder, **options) -> dict:
    """Made in one way: what makes scenes here knows no others."""
    return run_sharp(posed_subjects(folder, TRIPLES), 2, Bench(render, ways=(PLAIN,), **options))


def test_the_truth_is_near_its_photo_and_as_far_as_the_grid(folder, program):
    result = judged(folder)
    grid, plain = result["measures"]["grid"], result["measures"]["plain"]
    (first, _) = result["cases"]
    assert first["name"] == "001-007" and first["grid"] == [56, 42] and first["size"] == [112, 84]
    assert plain["photos"]["psnr"] > 20 and plain["between"]["psnr"] > 18
    assert plain["photos"]["psnr"] < grid["photos"]["psnr"] and plain["photos"]["detail"] < 1
    assert 0.5 < plain["between"]["seen"] <= 1 and plain["between_small"]["psnr"] > 18
    assert plain["once"]["gaussians"] == 2 * 56 * 42
    assert plain["once"]["bytes"] > 30 * plain["once"]["gaussians"]
    assert "between_small" not in grid  # at the network's size the grid is the photo


def test_what_lets_light_through_is_told(folder, program):
    dense = judged(folder)["measures"]["plain"]["photos"]
    program.change = lambda scene: replace(
        scene, gaussians=replace(scene.gaussians, opacities=scene.gaussians.opacities * 0.3)
    )
    thin = judged(folder)["measures"]["plain"]["photos"]
    assert thin["opaque"] < dense["opaque"] and thin["opaque_8x"] < dense["opaque_8x"]
    assert thin["psnr"] < dense["psnr"] - 3
    program.change = lambda scene: scene.rows(torch.zeros(len(scene.gaussians), dtype=torch.bool))
    nothing = judged(folder)["measures"]["plain"]
    assert nothing["photos"]["opaque"] == 0 and nothing["photos"]["detail"] == 0


def test_without_depths_or_a_place_for_the_second_photo(folder, program, tmp_path):
    bare = write_folder(tmp_path / "photos", 7)
    for path in (bare.root / "depths").iterdir():
        path.unlink()
    bench = Bench(render, ways=(PLAIN,))
    row = run_sharp(posed_subjects(bare, TRIPLES[:1]), 1, bench)["measures"]["plain"]
    assert row["between"]["psnr"] > 15 and "seen" not in row["between"]  # the whole picture, holes black
    program.change = lambda scene: replace(
        scene.rows(torch.arange(56 * 42)), viewmats=scene.viewmats[:1], Ks=scene.Ks[:1]
    )
    alone = judged(folder)["measures"]["plain"]
    assert alone["photos"]["psnr"] > 20 and alone["between"]["psnr"] > 10
    without = run_sharp(posed_subjects(bare, TRIPLES[:1]), 1, bench)["measures"]["plain"]
    assert "between" not in without


def test_another_version_stands_beside(folder, program, tmp_path):
    judged(folder, keep=tmp_path)
    program.change = lambda scene: replace(
        scene, gaussians=replace(scene.gaussians, opacities=scene.gaussians.opacities * 0.5)
    )
    result = judged(folder, beside=tmp_path / "plain")
    assert list(result["measures"]) == ["grid", "plain", "other"]
    pairs = paired(result["cases"], "plain", "other", "photos", "psnr")
    change, error, count = difference(pairs)
    found = [row["columns"] for row in result["cases"]]
    changes = [c["plain"]["photos"]["psnr"] - c["other"]["photos"]["psnr"] for c in found]
    assert count == 2 and change == pytest.approx(np.mean(changes)) and change < -1
    assert error == pytest.approx(np.std(changes, ddof=1) / math.sqrt(2))
    assert result["measures"]["other"]["once"]["seconds"] is None  # nobody knows how long it took
    table = markdown(tables(result))
    assert "| measure | photo through the grid | plain | other version |" in table
    assert f"PSNR (dB) | {result['measures']['grid']['photos']['psnr']:.2f} |" in table
    assert "| plain minus | photo through the grid | other version |" in table
    with pytest.raises(SceneFileError, match="001-007"):
        judged(folder, beside=tmp_path)


def test_scenes_of_another_size_are_not_beside(folder, program, tmp_path):
    judged(folder, keep=tmp_path)
    program.change = lambda scene: replace(scene, view_size=(112, 84), Ks=scene.Ks * 2)
    with pytest.raises(InputError, match="saw its photos at 56 x 42"):
        judged(folder, beside=tmp_path / "plain")


def test_ways_that_are_not_there_are_refused(folder):
    subjects = posed_subjects(folder, TRIPLES)
    with pytest.raises(InputError, match="the detail 'finest' is unknown"):
        run_sharp(subjects, 1, Bench(render, ways=("finest",)))
    with pytest.raises(InputError, match="nothing to judge"):
        run_sharp([], 0, Bench(render))


def test_pictures_are_shown_with_the_photo_first(folder, program):
    seen = []
    judge(next(iter(posed_subjects(folder, TRIPLES[:1]))), Bench(render), seen.append)
    (sight,) = seen
    assert sight.name == "001-007" and list(sight.pictures) == ["photo", "plain", "normal", "grid"]
    assert {p.shape for p in sight.pictures.values()} == {(28, 37, 3)}  # close-ups: a third of either side


@pytest.mark.parametrize(
    ("photo", "grid", "size"),
    [
        ((4000, 3000), (252, 196), (756, 588)),  # three times the grid at most
        ((611, 460), (252, 196), (585, 455)),  # 9 : 7, as the network's crop, and not enlarged
        ((112, 84), (56, 42), (112, 84)),
        ((100, 100), (224, 224), (100, 100)),  # a photo below the grid
    ],
)
def test_the_size_of_a_photo(photo, grid, size):
    assert sharp_size(photo, grid) == size
    assert size[0] * grid[1] == size[1] * grid[0] and size[0] <= LAYERS.most_enlarged * grid[0]


def test_pairs_of_files_and_folders(tmp_path):
    shipped = pair_subjects()
    assert "living_room" in [subject.name for subject in shipped]
    left, right = (photo for photo in shipped[0].photos if isinstance(photo, Path))
    (named,) = pair_subjects([left, right])
    assert named == shipped[0] and named.between is None and named.intrinsics is None
    assert pair_subjects([right, left])[0].name == f"{right.stem}-{left.stem}"
    with named.files() as paths:
        assert paths == (left, right)
    cases: list[tuple[list[Path], str]] = [
        ([left], "photos come in pairs, but these are 1"),
        ([left, right, left, right], "two pairs are called"),
        ([tmp_path], "holds no photos NAME_left and NAME_right"),
    ]
    for photos, hint in cases:
        with pytest.raises(InputError, match=hint):
            pair_subjects(photos)


@pytest.mark.slow
def test_rooms_are_made_again_at_the_photos_size():
    pack = load_pack(TINY_PACK)
    with RoomRenderer(pack) as renderer:
        (subject,) = room_subjects(pack, renderer, count=1, times=2)
    assert subject.between is not None and subject.between.pose is not None
    first = subject.photo(0)
    assert first.image.shape[0] % 28 == 0 and first.depths is not None and first.depths.max() > 0.6
    torch.testing.assert_close(first.pose, torch.eye(4, dtype=torch.float64), atol=1e-6, rtol=0)
