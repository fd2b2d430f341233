"""Cameras beside true ones: any similarity is found, and what is wrong is told in its own unit."""

import math
import sys
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import torch
from PIL import Image
from scipy.spatial.transform import Rotation

from langflash_core.errors import MissingPackageError
from langflash_core.lab.evaluation import walk_colmap
from langflash_core.lab.evaluation.side_measures import Similarity
from langflash_core.lab.evaluation.walk_measures import (
    camera_errors,
    centres_of,
    fitted_cameras,
    lens_ratio,
    lit,
    walked,
)


def cameras(places: np.ndarray, turns: Rotation) -> np.ndarray:
    """World to camera, of cameras that stand somewhere, turned somehow."""
    found = np.tile(np.eye(4), (len(places), 1, 1))
    found[:, :3, :3] = turns.as_matrix()
    found[:, :3, 3] = -np.einsum("vij,vj->vi", found[:, :3, :3], places)
    return found


def straight(count: int) -> np.ndarray:
    """A walk along a line, 10 cm a step, looking about."""
    places = np.arange(count)[:, None] * np.array([0.1, 0, 0])
    return cameras(places, Rotation.from_euler("yx", np.random.default_rng(1).normal(0, 9, (count, 2)), True))


SIMILARITY = Similarity(
    2.5, Rotation.from_euler("xyz", (20, -50, 70), True).as_matrix(), np.array([3.0, -1, 2])
)


def in_a_scene(truth: np.ndarray) -> np.ndarray:
    return np.stack([SIMILARITY.viewmat(camera) for camera in truth])


@pytest.mark.parametrize("count", [1, 2, 3, 9])
def test_true_cameras_in_another_world_have_no_error(count):
    """Also on a line, and with two of them: their directions tell what their places leave open."""
    truth = straight(count)
    fit = fitted_cameras(in_a_scene(truth), truth)
    errors = camera_errors(in_a_scene(truth), truth, fit)
    assert errors.places.max() < 1e-9 and errors.rotations.max() < 1e-6
    assert fit.scale == pytest.approx(2.5 if count > 1 else 1.0)
    assert np.allclose(fit.viewmat(truth[0]), in_a_scene(truth)[0] if count > 1 else fit.viewmat(truth[0]))


def test_one_camera_that_is_wrong_pulls_no_other():
    truth = straight(9)
    found = in_a_scene(truth)
    moved = np.eye(4)
    moved[:3, :3], moved[0, 3] = Rotation.from_euler("y", 30, True).as_matrix(), 0.2  # half a metre
    found[4] = moved @ found[4]
    errors = camera_errors(found, truth, fitted_cameras(found, truth))
    assert np.delete(errors.places, 4).max() < 2e-3 and np.delete(errors.rotations, 4).max() < 0.1
    assert errors.rotations[4] == pytest.approx(30, abs=0.1)
    assert errors.places[4] == pytest.approx(0.5, abs=0.01)


def test_two_cameras_that_stand_wrong_are_still_turned_right():
    """Near each other, a place is easily found on the wrong side."""
    truth = straight(2)
    for degrees in (60, 180):
        places = centres_of(truth) @ Rotation.from_euler("y", degrees, True).as_matrix().T
        found = cameras(places, Rotation.from_matrix(truth[:, :3, :3]))
        fit = fitted_cameras(found, truth)
        errors = camera_errors(found, truth, fit)
        assert errors.rotations.max() < 1 and errors.places.min() > 0.04 and fit.scale == pytest.approx(1)


def test_errors_are_metres_and_degrees():
    truth = straight(3)
    found = truth.copy()
    lifted = centres_of(truth)[1:2] + np.array([0, 0.02, 0])
    found[1] = cameras(lifted, Rotation.from_matrix(truth[1:2, :3, :3]))[0]
    found[2, :3] = Rotation.from_euler("z", 3, True).as_matrix() @ found[2, :3]
    errors = camera_errors(found, truth, Similarity(1.0, np.eye(3), np.zeros(3)))
    assert np.allclose(errors.places, [0, 0.02, 0]) and np.allclose(errors.rotations, [0, 0, 3], atol=1e-6)
    assert walked(truth) == pytest.approx(0.2)


def test_cameras_in_one_place_are_finite():
    truth = cameras(np.zeros((3, 3)), Rotation.from_euler("y", [[0], [20], [40]], True))
    fit = fitted_cameras(in_a_scene(truth), truth)
    assert fit.scale == 1.0 and camera_errors(in_a_scene(truth), truth, fit).rotations.max() < 1e-6


def test_a_gain_and_an_offset_are_taken_out_and_nothing_else():
    drawn = torch.rand(500, 3, generator=torch.Generator().manual_seed(2))
    photo = drawn * torch.tensor([0.7, 1.1, 1.0]) + torch.tensor([0.1, 0.0, -0.05])
    assert torch.allclose(lit(drawn, photo), photo, atol=1e-5)
    swapped = photo[:, [1, 2, 0]]
    assert float((lit(drawn, swapped) - swapped).square().mean()) > 0.02
    assert torch.allclose(lit(torch.zeros(9, 3), photo[:9]), photo[:9].mean(0).expand(9, 3))


def test_a_lens_is_judged_by_its_mean_focal_length():
    Ks = [torch.diag(torch.tensor([f, f, 1.0])) for f in (110.0, 96.0)]
    assert lens_ratio(Ks, [torch.diag(torch.tensor([101.0, 99.0, 1.0]))] * 2) == pytest.approx(1.03)


class FakeColmap(SimpleNamespace):
    """Remembers what it was told, and finds two models."""

    def __init__(self, models):
        super().__init__(models=models, logging=SimpleNamespace(minloglevel=0, FATAL=3), told={})
        self.CameraMode = self.Device = SimpleNamespace(SINGLE="single", cpu="cpu")
        for name in ("ImageReaderOptions", "FeatureExtractionOptions", "FeatureMatchingOptions"):
            setattr(self, name, SimpleNamespace)
        self.IncrementalPipelineOptions = SimpleNamespace
        self.set_random_seed = lambda seed: None
        self.match_exhaustive = lambda database, options, device: None

    def extract_features(self, database, folder, names, mode, reader, extraction, device):
        self.told |= {"names": names, "mode": mode, "reader": reader}

    def incremental_mapping(self, database, folder, out, options):
        self.told["options"] = options
        return dict(enumerate(self.models))


def model(names: list[str], focal: float) -> SimpleNamespace:
    pose = SimpleNamespace(matrix=lambda: np.eye(4)[:3])
    images = {
        k: SimpleNamespace(name=n, has_pose=True, cam_from_world=lambda: pose) for k, n in enumerate(names)
    }
    camera = SimpleNamespace(mean_focal_length=lambda: focal)
    return SimpleNamespace(images=images, cameras={1: camera}, num_reg_images=lambda: len(images))


def test_the_largest_model_of_colmap_counts(tmp_path, monkeypatch):
    fake = FakeColmap([model(["a.png"], 90.0), model(["b.png", "c.png"], 100.0)])
    monkeypatch.setitem(sys.modules, "pycolmap", fake)
    paths = [tmp_path / name for name in ("a.png", "b.png", "c.png")]
    found = walk_colmap.mapped(paths, None)
    assert set(found.viewmats) == {"b", "c"} and found.focal == 100 and found.seconds >= 0
    assert fake.told["reader"].camera_model == "SIMPLE_RADIAL" and fake.told["mode"] == "single"
    assert not hasattr(fake.told["options"], "ba_refine_focal_length")
    walk_colmap.mapped(paths, (100.0, 101.0, 60.0, 40.0))
    assert fake.told["reader"].camera_params == "100.0,101.0,60.0,40.0"
    assert fake.told["options"].ba_refine_focal_length is False
    monkeypatch.setattr(fake, "models", [])
    none = walk_colmap.mapped(paths, None)
    assert none.viewmats == {} and none.focal is None and math.isfinite(none.seconds)


def test_without_colmap_its_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.raises(MissingPackageError, match=r"langflash\[colmap\]"):
        walk_colmap.check_installed()


def corner_photo(viewmat: np.ndarray, K: np.ndarray, size: tuple[int, int], noise: np.ndarray) -> np.ndarray:
    """(h, w) uint8 of two walls at a right angle, z = 4 + x and z = 4 - x, with noise painted on them."""
    turn, centre = viewmat[:3, :3], -viewmat[:3, :3].T @ viewmat[:3, 3]
    x, y = np.meshgrid(np.arange(size[0]) + 0.5, np.arange(size[1]) + 0.5)
    rays = np.stack([x, y, np.ones_like(x)], -1) @ np.linalg.inv(K).T @ turn
    ways = [(4 - centre[2] + side * centre[0]) / (rays[..., 2] - side * rays[..., 0]) for side in (1, -1)]
    points = centre + np.minimum(*ways)[..., None] * rays
    u, v = (100 * (points[..., axis] + 3.5) for axis in (0, 1))
    return cv2.remap(noise, u.astype(np.float32), v.astype(np.float32), cv2.INTER_AREA)


@pytest.mark.filterwarnings("default")  # of other people's packages
def test_colmap_itself_finds_cameras(tmp_path):
    """Two that look at a painted corner from 12 degrees aside, either way."""
    pytest.importorskip("pycolmap")
    size, K = (320, 240), np.array([[300.0, 0, 160], [0, 300.0, 120], [0, 0, 1]])
    generator = np.random.default_rng(0)
    coarse, fine = (generator.integers(0, 255, (side, side)).astype(np.uint8) for side in (70, 350))
    large = [cv2.resize(each, (700, 700), interpolation=cv2.INTER_CUBIC) for each in (coarse, fine)]
    noise = (0.5 * large[0] + 0.5 * large[1]).astype(np.uint8)
    turns = Rotation.from_euler("y", [[-12], [12]], degrees=True)
    given = cameras(np.array([0.0, 0, 4]) - turns.apply([0.0, 0, 3]), turns.inv())
    paths = [tmp_path / name for name in ("left.png", "right.png")]
    for path, viewmat in zip(paths, given, strict=True):
        Image.fromarray(corner_photo(viewmat, K, size, noise)).save(path)
    found = walk_colmap.mapped(paths, (300.0, 300.0, 160.0, 120.0))
    step = found.viewmats["right"] @ np.linalg.inv(found.viewmats["left"])
    true = given[1] @ np.linalg.inv(given[0])
    turned = Rotation.from_matrix(step[:3, :3] @ true[:3, :3].T).magnitude()
    ways = step[:3, 3] / np.linalg.norm(step[:3, 3]), true[:3, 3] / np.linalg.norm(true[:3, 3])
    apart = np.arccos(ways[0] @ ways[1])
    assert np.degrees(turned) < 1.0 and np.degrees(apart) < 2.0, "a pixel is .2 degrees"
    assert found.focal == 300.0
