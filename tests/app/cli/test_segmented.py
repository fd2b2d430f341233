"""`langflash export --segmented`, and the single files of the same: definitions, manifest, the way back."""

import io
import json
import shlex
import sys
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from app.cli import main
from tests.app.cli.conftest import HEIGHT, WIDTH, pixels, stripes

TORCH = ("--backend", "torch")
ASKED = ("--prompt", "armchair", "floor lamp", "submarine")


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def folder(scene_file, tmp_path_factory) -> Path:
    """Made once; tests only read it."""
    out = tmp_path_factory.mktemp("segmented") / "new" / "out"
    with redirect_stdout(io.StringIO()) as said:
        code = main(["export", str(scene_file), "-o", str(out), "--segmented", *ASKED, *TORCH])
    assert code == 0 and "2 of 3 phrases, 2 instances in 2 views" in said.getvalue()
    return out


@pytest.fixture
def manifest(folder) -> dict:
    return json.loads((folder / "manifest.json").read_text("utf-8"))


def test_the_manifest_names_every_file(folder, manifest):
    named = {"manifest.json", *manifest["files"].values()}
    for view in manifest["views"]:
        parts = [view["files"]["union"], *view["files"]["phrases"].values()]
        own = [name for name in view["files"].values() if isinstance(name, str)]
        own += [name for part in parts for name in part.values()]
        own += [str(Path(name).with_suffix(".json")) for name in ("labels.png", "instances.png")]
        named |= {f"{view['folder']}/{name}" for name in own}
    assert named == set(files_of(folder))
    assert set(manifest["views"][0]["files"]["phrases"]) == {"armchair", "floor lamp"}


def test_its_command_makes_it_again(done, folder, manifest, tmp_path):
    words = shlex.split(manifest["command"])
    assert words[0] == "langflash" and words[words.index("-o") + 1] == str(folder)
    words[words.index("-o") + 1] = str(tmp_path / "again")
    done(*words[1:])
    before, after = files_of(folder), files_of(tmp_path / "again")
    assert after.keys() == before.keys()
    differing = [name for name in before if before[name] != after[name]]
    assert differing == ["manifest.json"]  # which says where it is


def test_masks_are_of_what_was_asked(folder, manifest):
    armchair, lamp, submarine = manifest["phrases"]
    assert armchair["found"] and lamp["found"] and not submarine["found"] and not submarine["instances"]
    assert [each["name"] for each in armchair["instances"]] == ["armchair 1"]
    view = folder / "photo_1"
    mask, soft = pixels(view / "armchair_mask.png"), pixels(view / "armchair_soft.png")
    assert soft.dtype == np.uint16 and mask.shape == (HEIGHT, WIDTH)
    assert np.array_equal(mask == 255, soft >= 65535 / 2)
    assert 0.25 < (mask == 255).mean() < 0.4  # the left third
    union = pixels(view / "union_soft.png").astype(float)
    both = soft.astype(float) + pixels(view / "floor_lamp_soft.png")
    assert np.abs(union - both).max() <= 2  # roundings; nothing is of both
    cut = pixels(view / "armchair_cutout.png")
    assert np.array_equal(cut[..., 3], np.rint(soft / 257))
    labels, instances = pixels(view / "labels.png"), pixels(view / "instances.png")
    assert np.array_equal(labels == 1, instances == 1) and set(np.unique(labels)) == {0, 1, 2}
    thirds = [WIDTH // 6, WIDTH // 2, 5 * WIDTH // 6]
    assert labels[HEIGHT // 2, thirds].tolist() == [1, 2, 0]  # "wooden floor" is no "floor lamp"
    legend = json.loads((view / "instances.json").read_text("utf-8"))
    assert [entry["label"] for entry in legend["labels"]] == ["", "armchair 1", "floor lamp 1"]


def test_depth_comes_back_by_the_scale_in_the_manifest(folder, manifest):
    depth = pixels(folder / "photo_1" / "depth.png") * manifest["depth"]["step"]
    inside = depth[2:-2, 2:-2]
    assert manifest["unit"] == "scene" and np.abs(inside - 1).max() < 1e-3  # a wall at 1
    view = manifest["views"][1]
    assert view["viewmat"] == stripes().viewmats[1].tolist() and (view["width"], view["height"]) == (56, 42)


def test_a_scene_of_known_scale_is_in_metres(done, tmp_path):
    from langflash_core.scene.file import save

    save(stripes().with_record(metric_scale=2.5), tmp_path / "m.langflash")
    done("export", tmp_path / "m.langflash", "-o", tmp_path / "m", "--segmented", *ASKED, *TORCH)
    manifest = json.loads((tmp_path / "m" / "manifest.json").read_text("utf-8"))
    depth = pixels(tmp_path / "m" / "photo_1" / "depth.png") * manifest["depth"]["step"]
    assert manifest["unit"] == "m" and np.abs(depth[2:-2, 2:-2] - 2.5).max() < 3e-3
    box = manifest["phrases"][0]["instances"][0]["box"]
    assert box["center"][2] == pytest.approx(2.5, abs=1e-3)


def test_boxes_are_bodies_by_name(folder, manifest):
    bodies = trimesh.load_scene(folder / "boxes.glb")
    assert set(bodies.geometry) == {"armchair 1", "floor lamp 1"}
    pose, _ = bodies.graph["armchair 1"]
    centre = manifest["phrases"][0]["instances"][0]["box"]["center"]
    np.testing.assert_allclose(pose[:3, 3], np.array(centre) * [-1, -1, 1], atol=1e-5)


def test_what_a_package_is_missing_for_is_left_out_and_said(done, scene_file, tmp_path, monkeypatch):
    for name in ("OpenEXR", "skimage", "skimage.measure"):
        monkeypatch.setitem(sys.modules, name, None)
    outcome = done("export", scene_file, "-o", tmp_path / "out", "--segmented", *ASKED, *TORCH)
    assert outcome.out.count("langflash[views]") == 2
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text("utf-8"))
    assert set(manifest["left_out"]) == {"depth.exr", "surfaces.glb"}
    assert "surfaces" not in manifest["files"] and not list(tmp_path.rglob("*.exr"))


def test_one_view_and_a_size(done, scene_file, tmp_path):
    words = ("--segmented", "--view", "2", "--size", "28x21", *ASKED, *TORCH)
    done("export", scene_file, "-o", tmp_path / "out", *words)
    assert {path.name for path in (tmp_path / "out").iterdir() if path.is_dir()} == {"photo_2"}
    assert pixels(tmp_path / "out" / "photo_2" / "rgb.png").shape == (21, 28, 3)
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text("utf-8"))
    assert "--view 2 --size 28x21" in manifest["command"] and manifest["views"][0]["view"] == 2


def test_phrases_may_be_called_union(done, scene_file, tmp_path):
    words = ("--segmented", "--threshold", "0.000001", "--prompt", "union", "!?", *TORCH)
    done("export", scene_file, "-o", tmp_path / "out", *words)
    names = {path.name for path in (tmp_path / "out" / "photo_1").iterdir()}
    assert {"union_mask.png", "union_2_mask.png", "prompt_2_mask.png"} <= names


def test_backends_agree(done, scene_file, tmp_path, folder):
    done("export", scene_file, "-o", tmp_path / "gl", "--segmented", *ASKED, "--backend", "gl")
    for name in ("armchair_soft.png", "union_soft.png"):
        exact, drawn = (pixels(place / "photo_1" / name) / 65535.0 for place in (folder, tmp_path / "gl"))
        assert np.abs(exact - drawn).max() < 5e-3  # sums in float16
    for name in ("labels.png", "instances.png"):
        exact, drawn = (pixels(place / "photo_1" / name) for place in (folder, tmp_path / "gl"))
        assert (exact != drawn).mean() < 5e-3  # pixels that are half of each


@pytest.mark.parametrize("what", ["soft", "cutout", "instances"])
def test_single_pictures_are_those_of_the_folder(done, scene_file, tmp_path, folder, what):
    words = ("--all-views", "--what", what, *ASKED, *TORCH)
    done("export", scene_file, "-o", tmp_path / "a.png", *words)
    name = "instances.png" if what == "instances" else f"union_{what}.png"
    for number in (1, 2):
        assert np.array_equal(pixels(tmp_path / f"a_{number}.png"), pixels(folder / f"photo_{number}" / name))
    assert (tmp_path / "a_1.json").exists() == (what == "instances")


def test_single_depths(done, scene_file, tmp_path, folder, manifest):
    done("export", scene_file, "-o", tmp_path / "a.png", "--what", "depth", *TORCH)
    first, again = pixels(folder / "photo_1" / "depth.png"), pixels(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        step = float(picture.info["step"])
    assert np.abs(first * manifest["depth"]["step"] - again * step).max() <= step + manifest["depth"]["step"]
    exr = pytest.importorskip("OpenEXR")
    done("export", scene_file, "-o", tmp_path / "a.exr", *TORCH)
    with exr.File(str(tmp_path / "a.exr")) as file:
        assert np.abs(file.channels()["Z"].pixels - again * step).max() <= step


def test_a_surface_as_a_mesh(done, scene_file, tmp_path):
    pytest.importorskip("skimage")
    words = ("--what", "surface", "--prompt", "armchair", "wooden floor", *TORCH)
    outcome = done("export", scene_file, "-o", tmp_path / "a.glb", *words)
    assert "2 surfaces" in outcome.out
    bodies = trimesh.load_scene(tmp_path / "a.glb")
    assert set(bodies.geometry) == {"armchair", "wooden floor"}
    low, high = bodies.bounds
    # A wall 1.6 x 1.2 at depth 1, less the 2 % of outliers; x turns to the left.
    np.testing.assert_allclose((low + high)[2] / 2, 1.0, atol=0.02)
    np.testing.assert_allclose((high - low)[:2], [1.6, 1.2], atol=0.12)
    pose, name = bodies.graph["armchair"]
    assert trimesh.transform_points(bodies.geometry[name].vertices, pose)[:, 0].min() > 0.2


def test_what_another_view_hides_is_not_found_there(run, scene_file, tmp_path):
    camera = tmp_path / "away.json"
    away = np.diag([-1.0, 1.0, -1.0, 1.0]).tolist()
    K = [[35.0, 0.0, 28.0], [0.0, 35.0, 21.0], [0.0, 0.0, 1.0]]
    camera.write_text(json.dumps({"viewmat": away, "K": K, "width": 56, "height": 42}))
    words = ("--what", "cutout", "--prompt", "armchair", "--camera", camera, *TORCH)
    outcome = run("export", scene_file, "-o", tmp_path / "a.png", *words)
    assert outcome.code == 2 and "not found in this view" in outcome.err and not (tmp_path / "a.png").exists()
