"""Splat files through every command, and every kind of export."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from app.window.scene.drops import SCENE_SUFFIXES
from langflash_core.base.outputs import ALL_OUT
from langflash_core.export import READERS, WRITERS, export, read
from langflash_core.export.language import side_car
from langflash_core.language.spaces import language_space
from langflash_core.scene.file import save
from langflash_core.types import Scene
from tests.app.cli.conftest import HEIGHT, WIDTH, WORDS, pixels, stripes
from tests.app.gl.test_gl_layers import layered
from tests.export.pages import read_page
from tests.export.splats import damaged_files

TORCH = ("--backend", "torch")
DAMAGED = damaged_files()
IN_ORDER = (".langflash", ".ply", ".splat", ".spz", ".glb")  # the others sort along a curve


@pytest.fixture(scope="session")
def ply_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("splats") / "stripes.ply"
    export(stripes(), path)
    side_car(path).unlink()
    return path


def test_the_suffixes_of_commands_are_those_of_the_core():
    assert {ending for ending, own in WRITERS.items() if "of_scene" in own} <= set(ALL_OUT)
    assert {".png", ".json"} <= set(ALL_OUT) & set(WRITERS)
    assert set(READERS) - {"meta.json"} == SCENE_SUFFIXES


@pytest.mark.parametrize("backend", ["torch", "gl"])
def test_a_ply_is_drawn_from_the_camera_that_frames_it(done, ply_file, tmp_path, backend):
    words = ("render", ply_file, "-o", tmp_path / "a.png", "--size", "96x72", "--backend", backend)
    outcome = done(*words, "--json")
    assert outcome.json()["size"] == [96, 72]
    seen = pixels(tmp_path / "a.png").astype(int)
    # Red, green and blue stripes fill the view, left to right.
    thirds = [seen[:, 32 * third + 8 : 32 * third + 24].mean((0, 1)).argmax() for third in range(3)]
    assert thirds == [0, 1, 2] and (seen.sum(-1) > 60).mean() > 0.8
    done(*words[:4], "--what", "depth", "--size", "96x72", *TORCH)


def test_the_size_of_a_sog_folder_is_that_of_its_files(run, ply_file, tmp_path):
    folder = tmp_path / "sog"
    outcome = run("export", ply_file, "-o", folder / "meta.json")
    whole = sum(file.stat().st_size for file in folder.iterdir())
    assert whole > 5 * (folder / "meta.json").stat().st_size
    assert f"{whole / 1e6:.1f} MB" in outcome.out


def test_info_of_a_splat_file(run, ply_file):
    document = run("info", ply_file, "--json").json()
    assert document["gaussians"] == WIDTH * HEIGHT and document["atoms"] == 0
    assert document["source"] == "stripes.ply" and document["space"] == "none"
    assert document["file_bytes"] == ply_file.stat().st_size


def test_splat_files_have_no_language(refused, ply_file, tmp_path):
    for words in (
        ("query", ply_file, "armchair", "-o", tmp_path / "out"),
        ("render", ply_file, "--what", "relevance", "--prompt", "armchair", "-o", tmp_path / "a.png"),
        ("export", ply_file, "--prompt", "armchair", "-o", tmp_path / "a.ply"),
        ("export", ply_file, "--prompt", "armchair", "-o", tmp_path / "a.json"),
        ("export", ply_file, "--prompt", "armchair", "-o", tmp_path / "a.html"),
    ):
        assert "langflash lift FILE -o SCENE.langflash" in refused(*words, *TORCH)
    assert "no atoms" in refused("render", ply_file, "--what", "atoms", "-o", tmp_path / "a.png", *TORCH)
    assert "no photo 2" in refused("render", ply_file, "--view", "2", "-o", tmp_path / "a.png", *TORCH)


def test_a_page_holds_the_whole_scene_and_the_phrases(done, refused, scene_file, ply_file, tmp_path):
    outcome = done(
        "export", scene_file, "-o", tmp_path / "new" / "a.html", "--prompt", "armchair", " floor  lamp"
    )
    assert f"{WIDTH * HEIGHT:,} Gaussians" in outcome.out and "answers" in outcome.out
    header = read_page(tmp_path / "new" / "a.html").header
    assert header["title"] == scene_file.stem and header["count"] == WIDTH * HEIGHT
    assert header["phrases"]["texts"][:2] == ["armchair", "floor lamp"] and header["phrases"]["asked"] == 2
    outcome = done("export", ply_file, "-o", tmp_path / "new" / "plain.html")
    assert "answers" not in outcome.out
    page = tmp_path / "b.html"
    assert "leave --view out" in refused("export", scene_file, "-o", page, "--view", "1")
    assert "is for videos" in refused("export", scene_file, "-o", page, "--seconds", "3")
    assert "is for web pages" in refused("export", scene_file, "-o", tmp_path / "b.ply", "--with-text")
    assert "'minilm' only" in refused("export", ply_file, "-o", page, "--with-text")
    assert "needs a phrase" in refused("export", scene_file, "-o", page, "--threshold", "0.5")
    assert "takes a .png" in refused("export", scene_file, "-o", page, "--what", "rgb")


@pytest.mark.parametrize(
    ("photos", "said"), [(12, "in 8 of 12 layers"), (3, "in 3 layers"), (1, "Gaussians, ")]
)
def test_a_page_says_how_many_layers_it_holds(done, tmp_path, photos, said):
    walk = layered(photos, count=60, num_atoms=0)
    quats = torch.nn.functional.normalize(walk.gaussians.quats, dim=1)
    save(replace(walk, gaussians=replace(walk.gaussians, quats=quats)), tmp_path / "walk.langflash")
    outcome = done("export", tmp_path / "walk.langflash", "-o", tmp_path / "a.html")
    assert said in outcome.out


@pytest.mark.parametrize("suffix", IN_ORDER)
def test_every_scene_format_out_and_in_again(done, scene_file, tmp_path, suffix):
    path = tmp_path / "new" / f"a{suffix}"
    outcome = done("export", scene_file, "-o", path)
    beside = {side_car(path).name} if suffix == ".ply" else set()
    assert (
        f"{WIDTH * HEIGHT:,} Gaussians" in outcome.out
        and set(os.listdir(path.parent)) == {path.name} | beside
    )
    assert all(name in outcome.out for name in beside)
    again = read(path).gaussians
    assert torch.allclose(again.means, stripes().gaussians.means, atol=1e-5)
    # 1/255 of opacity and half a step of colour are what .splat holds.
    assert torch.allclose(again.opacities, stripes().gaussians.opacities, atol=0.5 / 255 + 1e-6)
    outcome = done("render", path, "-o", tmp_path / "a.png", "--size", "56x42", *TORCH)
    assert outcome.err == ""


@pytest.mark.parametrize("suffix", IN_ORDER)
def test_a_phrase_keeps_its_gaussians(done, scene_file, tmp_path, suffix):
    path = tmp_path / f"chair{suffix}"
    done("export", scene_file, "-o", path, "--prompt", "armchair", "--threshold", "0.8")
    scene, whole = read(path), stripes()
    left = whole.gaussians.means[whole.semantics.weight_ids[:, 0] == 0]
    assert torch.allclose(scene.gaussians.means, left, atol=1e-5)  # the left third, and nothing else
    if suffix in (".langflash", ".ply", ".glb"):
        assert scene.semantics.num_atoms == 3 and scene.num_views == 2


def test_a_phrase_that_nothing_answers(refused, scene_file, tmp_path):
    for name in ("a.ply", "a.json", "a.png"):
        words = ("export", scene_file, "--prompt", "submarine", "--threshold", "0.95", *TORCH)
        sentence = refused(*words, "-o", tmp_path / name)
        assert "submarine" in sentence and "threshold" in sentence


def test_coco_of_all_views_with_their_pictures(done, scene_file, tmp_path):
    words = ("export", scene_file, "--prompt", "armchair", "wooden floor", "submarine", *TORCH)
    done(*words, "-o", tmp_path / "m.json")
    document = json.loads((tmp_path / "m.json").read_text())
    assert [c["name"] for c in document["categories"]] == ["armchair", "wooden floor", "submarine"]
    assert {(a["image_id"], a["category_id"]) for a in document["annotations"]} == {
        (1, 1), (1, 2), (2, 1), (2, 2),
    }  # fmt: skip
    assert set(os.listdir(tmp_path)) == {"m.json", *(image["file_name"] for image in document["images"])}
    assert [image["file_name"] for image in document["images"]] == ["m_1.png", "m_2.png"]
    for image in document["images"]:
        assert pixels(tmp_path / image["file_name"]).shape == (image["height"], image["width"], 3)
    x, _, width, _ = document["annotations"][0]["bbox"]
    assert x == 0 and abs(x + width - WIDTH / 3) < 4  # the left third, and a soft edge
    done(*words, "--view", "2", "-o", tmp_path / "one.json")
    assert len(json.loads((tmp_path / "one.json").read_text())["images"]) == 1


def test_a_view_as_numbers_holds_its_feature_image(run, scene_file, tmp_path):
    """F = W D, normalised, gives the cosines that a query gives, but for the rounding to float32."""
    run("export", scene_file, *TORCH, "-o", tmp_path / "view.npz")
    run("export", scene_file, *TORCH, "--prompt", WORDS[0], "-o", tmp_path / "answer.npz")
    run("query", scene_file, WORDS[0], *TORCH, "--mode", "cosine", "--npz", "-o", tmp_path / "out")
    (cosines,) = (tmp_path / "out").glob("*.npz")
    with np.load(tmp_path / "view.npz") as view, np.load(cosines) as asked:
        features = view["weights"].astype(np.float64) @ view["dictionary"]
        space = language_space(str(view["space"]))
        phrase = space.encode([WORDS[0]])[0].double().numpy()
        norms = np.linalg.norm(features, axis=-1)
        solid = view["alphas"] > 0.5
        cosine = (features @ phrase / np.maximum(norms, 1e-4))[solid]
        assert features.shape == (*view["rgb"].shape[:2], space.dimension)
        assert np.abs(cosine - asked["relevance"][0][solid]).max() <= 1e-5
        assert np.abs(view["depth"] - asked["depth"]).max() <= 1e-6
    with np.load(tmp_path / "answer.npz") as answer:
        assert answer["prompts"].tolist() == [WORDS[0]] and answer["mask"].any()


def test_label_map_and_legend(done, scene_file, tmp_path):
    words = ("--what", "labels", "--prompt", *WORDS, *TORCH)
    outcome = done("export", scene_file, "-o", tmp_path / "l.png", *words)
    assert "l.json" in outcome.out
    labels = pixels(tmp_path / "l.png")
    assert labels.shape == (HEIGHT, WIDTH)
    assert [int(np.median(labels[:, column])) for column in (8, 28, 50)] == [1, 2, 3]
    legend = json.loads((tmp_path / "l.json").read_text())
    assert legend["picture"] == "l.png" and [entry["label"] for entry in legend["labels"]] == ["", *WORDS]


def test_what_lies_beside_is_replaced_only_by_its_own_kind(run, done, scene_file, tmp_path):
    """Nobody named these files: the legend of a label map, the pictures of a COCO file."""
    label = ("export", scene_file, "-o", tmp_path / "v.png", "--what", "labels", "--prompt", *WORDS, *TORCH)
    masks = ("export", scene_file, "-o", tmp_path / "v.json", "--view", "1", "--prompt", *WORDS, *TORCH)
    done(*masks)
    before = (tmp_path / "v.json").read_bytes()
    outcome = run(*label)
    assert outcome.code == 2 and "v.json" in outcome.err and "--replace" in outcome.err
    assert (tmp_path / "v.json").read_bytes() == before and not (tmp_path / "v.png").exists()
    done(*masks)  # its own picture of the time before
    assert run(*label, "--replace").code == 0 and run(*label).code == 0
    outcome = run(*masks)
    assert outcome.code == 2 and "v.json" in outcome.err  # a legend now
    done(*masks, "--replace")


# imageio-ffmpeg leaves the pipes of its finished processes to the garbage collector.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("name", ["stripes", "turntable"])
def test_video(done, scene_file, ply_file, tmp_path, name):
    film = pytest.importorskip("imageio_ffmpeg")
    if name == "turntable":  # moved off the origin, so that it is seen from outside
        gaussians = read(ply_file).gaussians
        gaussians.means[:, 2] -= 1
        from langflash_core.scene.bare import bare_scene

        source = tmp_path / "t.splat"
        export(bare_scene(gaussians, "t"), source)
    else:
        source = scene_file
    words = ("--seconds", "0.4", "--size", "65x49", *TORCH)
    outcome = done("export", source, "-o", tmp_path / "a.mp4", *words)
    assert "64 x 48" in outcome.out
    frames = film.read_frames(str(tmp_path / "a.mp4"))
    described = next(frames)
    pictures = [np.frombuffer(frame, np.uint8).reshape(48, 64, 3).astype(int) for frame in frames]
    assert described["size"] == (64, 48) and len(pictures) == 12
    moved = max(np.abs(picture - pictures[0]).mean() for picture in pictures)
    assert moved > 1 and np.ptp(pictures[0]) > 100
    assert np.abs(pictures[-1] - pictures[0]).mean() <= moved  # it comes back


def test_video_without_its_package(refused, scene_file, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    sentence = refused("export", scene_file, "-o", tmp_path / "a.mp4", *TORCH)
    assert "langflash[video]" in sentence


@pytest.mark.parametrize(
    ("name", "words", "hint"),
    [
        ("a.obj", [], ", ".join(ALL_OUT)),
        ("a", [], ".png"),
        ("a.json", [], "--prompt"),
        ("a.png", ["--what", "labels"], "--prompt"),
        ("a.ply", ["--what", "labels", "--prompt", "armchair"], "takes a .png"),
        ("a.ply", ["--view", "1"], "leave --view out"),
        ("a.splat", ["--size", "9x9"], "leave --size out"),
        ("a.mp4", ["--view", "1"], "leave --view out"),
        ("a.png", ["--seconds", "3"], "--seconds"),
        ("a.png", ["--path", "orbit"], "--path is for videos"),
        ("a.webp", ["--what", "heat"], "--prompt"),
        ("a.mp4", ["--what", "labels", "--prompt", "armchair"], "takes a .png"),
        ("a.png", ["--what", "surface", "--prompt", "armchair"], "takes a .glb"),
        ("a.glb", ["--what", "surface"], "--prompt"),
        ("a.glb", ["--what", "surface", "--prompt", "armchair", "--view", "1"], "leave --view out"),
        ("a.png", ["--what", "instances"], "--prompt"),
        ("a.png", ["--what", "soft"], "--prompt"),
        ("a.png", ["--what", "depth", "--prompt", "armchair"], "takes no --prompt"),
        ("a.exr", ["--prompt", "armchair"], "takes no --prompt"),
        ("a.ply", ["--what", "depth"], "takes a .png or .exr"),
        ("a", ["--segmented"], "--segmented needs phrases"),
        ("a", ["--segmented", "--prompt", "armchair", "--what", "mask"], "no --what"),
        ("a", ["--segmented", "--prompt", "armchair", "--all-views"], "leave --all-views out"),
        ("a", ["--segmented", "--prompt", "armchair", "--seconds", "2"], "--seconds is for videos"),
        ("a", ["--segmented", "--prompt", "submarine", *TORCH], "lower --threshold"),
        ("a.mp4", ["--seconds", "0"], "--seconds"),
        ("a.ply", ["--threshold", "0.5"], "--prompt"),
    ],
)
def test_words_that_do_not_go_together(refused, scene_file, tmp_path, name, words, hint):
    assert hint in refused("export", scene_file, *words, "-o", tmp_path / name)


def test_an_export_never_overwrites_its_input(refused, ply_file, tmp_path):
    copy = tmp_path / "a.ply"
    copy.write_bytes(ply_file.read_bytes())
    assert "also an input" in refused("export", copy, "-o", copy)


@pytest.mark.parametrize("kind", DAMAGED)
def test_damaged_files(refused, tmp_path, kind):
    path = tmp_path / "bad.ply"
    path.write_bytes(DAMAGED[kind][0])
    for words in (("info", path), ("export", path, "-o", tmp_path / "a.splat")):
        assert DAMAGED[kind][1] in refused(*words)


def test_what_was_guessed_is_said_on_stderr(done, tmp_path):
    from tests.export.splats import ply_bytes, stored_columns

    columns = stored_columns()
    columns["opacity"] = np.linspace(0, 1, 50, dtype=np.float32)
    columns["x"][0] = np.nan
    (tmp_path / "a.ply").write_bytes(ply_bytes(columns))
    outcome = done("info", tmp_path / "a.ply", "--json")
    assert outcome.json()["gaussians"] == 49
    lines = outcome.err.splitlines()
    assert len(lines) == 2 and all(line.startswith("warning: ") for line in lines)


NUM_LARGE = 400_000
MEASURE = """
import sys
from pathlib import Path
from app.gl import SplatRenderer, offscreen_context
from langflash_core.export import read
def peak():  # of this program alone; getrusage's is inherited from the process that started it
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))
context = offscreen_context()
renderer = SplatRenderer(context)
small = read(Path(sys.argv[1]))
renderer.set_scene(small)
renderer.draw(small.camera(0, 64, 48), weight_maps=False)
Path("/proc/self/clear_refs").write_text("5")  # forget the peak so far
start = peak()
large = read(Path(sys.argv[2]))
loaded = peak()
renderer.set_scene(large)
renderer.draw(large.camera(0, 64, 48), weight_maps=False)
print(loaded - start, peak() - start)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="counts kilobytes as Linux does, draws through EGL")
def test_memory_grows_by_the_splat_and_not_more(tmp_path):
    """A file of 3 million splats with harmonics of degree 3 must load and draw in 4 GB.

    4 GB less half a GB for Python, torch and OpenGL leaves 1,160 bytes a splat; a splat is 236 bytes
    as a scene and 280 on the (software) GPU. A whole second copy of either would not fit the bounds.
    """
    from tests.export.splats import NAMES

    names = [*NAMES, *(f"f_rest_{index}" for index in range(45))]
    for name, count in (("small", 1000), ("large", NUM_LARGE)):
        rows = np.random.default_rng(0).normal(size=(count, len(names))).astype("<f4")
        rows[:, 7:10] -= 5
        header = "".join(f"property float {each}\n" for each in names)
        start = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{header}end_header\n"
        (tmp_path / f"{name}.ply").write_bytes(start.encode() + rows.tobytes())
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, tmp_path / "small.ply", tmp_path / "large.ply"],
        capture_output=True,
        text=True,
        timeout=300,
    )
    if "GraphicsError" in done.stderr:
        pytest.skip("no OpenGL")
    assert done.returncode == 0, done.stderr
    loaded, drawn = map(int, done.stdout.split())
    parts = 64e6  # file rows read at once, 32 MB, and what is made of them
    assert loaded < 300 * NUM_LARGE + parts
    assert drawn < 1000 * NUM_LARGE + parts


def leveled() -> Scene:
    """Stripes of which every second Gaussian is coarse, and larger."""
    scene = stripes()
    levels = (torch.arange(len(scene.gaussians)) % 2).to(torch.uint8)
    wide = scene.gaussians.scales * torch.where(levels == 0, 1.5, 1.0)[:, None]
    return replace(scene, levels=levels, gaussians=replace(scene.gaussians, scales=wide))


@pytest.mark.parametrize("suffix", [".ply", ".splat", ".langflash", ".html"])
def test_the_least_detail_is_the_coarse_layer(run, done, tmp_path, suffix):
    save(leveled(), tmp_path / "fine.langflash")
    low, whole = tmp_path / f"low{suffix}", tmp_path / f"whole{suffix}"
    outcome = run("export", tmp_path / "fine.langflash", "-o", low, "--detail", "low")
    coarse, count = WIDTH * HEIGHT // 2, WIDTH * HEIGHT
    assert outcome.code == 0 and f"{coarse:,} of {count:,} Gaussians" in outcome.out, outcome
    for words in ((), ("--detail", "all")):
        outcome = done("export", tmp_path / "fine.langflash", "-o", whole, *words)
        assert f": {count:,} Gaussians" in outcome.out
    assert low.stat().st_size < whole.stat().st_size
    if suffix == ".html":
        assert read_page(low).header["count"] == coarse
    else:
        again = read(low).gaussians
        assert torch.equal(again.means, stripes().gaussians.means[::2])
        assert float(again.scales.min()) == pytest.approx(0.03, rel=2**-11)  # float16 of the scene file


def test_the_least_detail_of_what_answers(done, tmp_path):
    """A third of the stripes is one word's: of its coarse ones all and no other is written."""
    save(leveled(), tmp_path / "fine.langflash")
    words = ("--prompt", "armchair", "--detail", "low")
    done("export", tmp_path / "fine.langflash", "-o", tmp_path / "low.ply", *words)
    armchair = leveled().semantics.weight_ids[::2, 0] == 0
    assert torch.equal(read(tmp_path / "low.ply").gaussians.means, stripes().gaussians.means[::2][armchair])


def test_the_least_detail_of_a_scene_without_levels_is_a_third(run, ply_file, tmp_path):
    outcome = run("export", ply_file, "-o", tmp_path / "low.ply", "--detail", "low")
    third = WIDTH * HEIGHT // 3
    assert outcome.code == 0 and f"{third:,} of {WIDTH * HEIGHT:,} Gaussians" in outcome.out, outcome
    # Equal ones are kept with equal chances, and cover together what they did: their axes grow by 3 ** 0.5.
    assert read(tmp_path / "low.ply").gaussians.scales.numpy() == pytest.approx(0.02 * 3**0.5, rel=1e-3)


@pytest.mark.parametrize(
    "words",
    [
        *("a.png", "transforms.json", "a.npz", "a.mp4", "a.json --prompt armchair"),
        *(f"a.glb --prompt armchair --what {what}" for what in ("boxes", "surface")),
        "folder --prompt armchair --segmented",
    ],
)
def test_the_least_detail_is_of_gaussians_alone(refused, scene_file, tmp_path, words):
    name, *more = words.split()
    said = refused("export", scene_file, "-o", tmp_path / name, *more, "--detail", "low")
    assert "--detail low is for splats, scenes and web pages" in said


def test_a_detail_that_is_unknown_is_named(refused, scene_file, tmp_path):
    said = refused("export", scene_file, "-o", tmp_path / "a.ply", "--detail", "tiny")
    assert "tiny" in said and "low" in said
