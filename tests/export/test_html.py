"""Pages: what a round trip keeps, what may stand in names, and that what they say is what we say."""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from langflash_core import pipeline
from langflash_core.base.resources import asset_path
from langflash_core.errors import InputError, PromptError
from langflash_core.export import export
from langflash_core.export.html import LAYERED, READING, SCRIPTS, Phrases, write_html
from langflash_core.export.settings import COLUMNS
from langflash_core.geometry.poses import Pose, Vector, from_view
from langflash_core.language.leads import shipped_leads
from langflash_core.language.relevance import compile_query
from langflash_core.language.settings import ANSWERING, RELEVANCE
from langflash_core.language.spaces import language_space
from langflash_core.language.vocabulary import all_phrases
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.tour import Note, Stop, Tour, told_tour
from langflash_core.splat.projection import NEAR
from langflash_core.types import Scene
from tests.app.window.scenes import CHAIR, PHRASES, room
from tests.export.pages import ReadPage, read_page
from tests.export.splats import random_gaussians
from tests.splat.scenes import cloud

PAGE = Path(pipeline.__file__).parent / "export" / "page"
ODD = (
    "\"quoted\" & 'single'",
    "</script><script>alert(1)</script>",
    "<!-- header -->",
    "Stuhl für Größe 日本 🪑",
)


@pytest.fixture(scope="module")
def spoken_room() -> Scene:
    return room(language_space("minilm").encode(PHRASES))


@pytest.fixture
def few(monkeypatch) -> None:
    """A vocabulary that takes no seconds to encode."""
    monkeypatch.setattr(pipeline, "all_phrases", lambda: PHRASES)


def phrases_of(scene: Scene, texts: tuple[str, ...]) -> Phrases:
    """Random scores, as if these texts had been asked."""
    rng = torch.Generator().manual_seed(0)
    count = scene.semantics.num_atoms
    scores = torch.rand(len(texts) + 2, count, generator=rng) * 2 - 1
    gram = scene.semantics.dictionary @ scene.semantics.dictionary.T
    return Phrases(texts, len(texts), scores[:-2], scores[-2:], gram, 10.0, 0.8)


def compare(scene: Scene, page: ReadPage) -> None:
    """Positions to half a step of 65535 of their logarithm, rotations to 8 bits, the rest to the books."""
    before, after = scene.gaussians, page.gaussians()
    assert len(before) == len(after) == page.header["count"]
    around = before.means.double() - torch.tensor(page.header["origin"])
    span = torch.tensor(page.header["highest"]) - torch.tensor(page.header["lowest"])
    bound = 0.5 / 65535 * span * (1 + around.abs()) + 1e-6 * (1 + before.means.abs())
    assert ((after.means - before.means).abs() <= 1.001 * bound).all()
    apart = torch.stack([(after.quats + sign * before.quats).norm(dim=-1) for sign in (1, -1)]).amin(0)
    assert float(4 * torch.asin((apart.double() / 2).clamp(max=1)).max()) <= 0.02
    assert float((after.opacities - before.opacities).abs().max()) <= 0.5 / 255 + 1e-6
    for name, values, found in (
        ("scaleBook", before.scales.log(), after.scales.log()),
        ("colourBook", before.sh[:, 0], after.sh[:, 0]),
    ):
        nearest = (values.double()[..., None] - torch.tensor(page.header[name])).abs().amin(-1)
        assert ((found - values).abs() <= nearest + 1e-4).all()
        assert len(page.header[name]) <= 256


@pytest.mark.parametrize("count", [1, 2, 700])
@pytest.mark.parametrize("degree", [0, 1, 3])
def test_gaussians_come_back_within_the_steps(tmp_path, count, degree):
    scene = bare_scene(random_gaussians(count, degree), "made")
    scene = replace(scene, view_ids=torch.zeros(count, dtype=torch.int64))  # keeps the order
    export(scene, tmp_path / "a.html")
    page = read_page(tmp_path / "a.html")
    compare(scene, page)
    rest = scene.gaussians.sh[:, 1:]
    found = page.gaussians().sh[:, 1:]
    assert found.shape == rest.shape
    assert not rest.numel() or float((found - rest).abs().max()) <= float(rest.amax() - rest.amin()) / 64


def test_places_far_from_the_origin_lose_nothing_to_it(tmp_path):
    scene = cloud(50, num_atoms=0, degree=0, dtype=torch.float32)
    far = torch.tensor([4.0e4, -7.0e4, 1.0e4])
    moved = replace(scene.gaussians, means=scene.gaussians.means + far)
    viewmat = scene.viewmats.clone()
    viewmat[:, :3, 3] -= viewmat[:, :3, :3].float() @ far
    write_html(replace(scene, gaussians=moved, viewmats=viewmat), tmp_path / "a.html")
    page = read_page(tmp_path / "a.html")
    assert np.allclose(page.header["origin"], far, atol=1e-2)
    assert max(map(abs, page.header["lowest"] + page.header["highest"])) < 2


def test_splats_of_other_programs_are_stored_along_a_curve(tmp_path):
    scene = bare_scene(random_gaussians(300), "made")
    write_html(scene, tmp_path / "a.html")
    means = (read_page(tmp_path / "a.html").gaussians().means, scene.gaussians.means)
    ordered, plain = (float(each.diff(dim=0).norm(dim=-1).mean()) for each in means)
    assert ordered < 0.5 * plain


def test_names_may_hold_anything(tmp_path):
    scene = cloud(5, num_atoms=3, degree=0, dtype=torch.float32)
    for title in ODD:
        write_html(scene, tmp_path / "a.html", phrases=phrases_of(scene, ODD), title=title)
        page = read_page(tmp_path / "a.html")
        assert page.header["phrases"]["texts"] == list(ODD)
        assert page.header["title"] == page.texts["title"] == page.texts["h1"] == title


def test_weights_and_phrases_come_back(tmp_path):
    scene = cloud(40, num_atoms=300, kept=3, degree=0, dtype=torch.float32)
    asked = phrases_of(scene, ("one", "two"))
    write_html(
        replace(scene, view_ids=torch.zeros(40, dtype=torch.int64)), tmp_path / "a.html", phrases=asked
    )
    page = read_page(tmp_path / "a.html")
    # Half a step of 255 each, and the sum is brought back to 1.
    assert np.abs(page.dense_weights() - scene.semantics.dense_weights().numpy()).max() <= 2 / 255
    for name in ("scores", "negatives", "gram"):
        numbers = getattr(asked, name).numpy()
        assert np.abs(page.numbers(name) - numbers).max() <= np.abs(numbers).max() / 65000
    assert page.header["phrases"]["asked"] == 2


def test_only_the_largest_weights_are_kept(tmp_path):
    scene = cloud(40, num_atoms=9, kept=8, degree=0, dtype=torch.float32)
    write_html(scene, tmp_path / "a.html", phrases=phrases_of(scene, ("one",)))
    found = read_page(tmp_path / "a.html").dense_weights()
    assert ((found > 0).sum(1) <= COLUMNS.most_weights).all() and np.allclose(found.sum(1), 1)


def test_a_page_scores_phrases_as_a_query_does(tmp_path, spoken_room):
    asked = ["armchair", "wall - door", "armchair"]
    said = pipeline.web_page(spoken_room, tmp_path / "a.html", asked, threshold=0.7)
    assert said is not None
    page = read_page(tmp_path / "a.html")
    texts = page.header["phrases"]["texts"]
    assert texts[:2] == ["armchair", "wall - door"] and set(all_phrases()) <= set(texts)
    assert page.header["phrases"]["asked"] == 2 and len(set(texts)) == len(texts)
    compiled = compile_query(spoken_room, language_space("minilm"), ["armchair", "wall - door"])
    assert np.allclose(page.numbers("scores")[:2], (compiled.prompts @ compiled.factor.T).numpy(), atol=1e-4)
    assert np.allclose(page.numbers("negatives"), (compiled.negatives @ compiled.factor.T).numpy(), atol=1e-4)
    assert page.header["phrases"]["threshold"] == 0.7
    assert page.header["phrases"]["temperature"] == compiled.temperature


def test_bad_questions_are_one_sentence(tmp_path, spoken_room, few):
    plain = bare_scene(random_gaussians(3), "made")
    with pytest.raises(PromptError, match="no language"):
        pipeline.web_page(plain, tmp_path / "a.html", ["chair"])
    with pytest.raises(PromptError, match="out of range"):
        pipeline.web_page(spoken_room, tmp_path / "a.html", ["chair"], threshold=1.5)
    assert not os.listdir(tmp_path)
    assert pipeline.web_page(plain, tmp_path / "a.html") is None
    assert "phrases" not in read_page(tmp_path / "a.html").header


def test_a_page_takes_the_text_model_along(tmp_path, spoken_room, few):
    pipeline.web_page(spoken_room, tmp_path / "a.html", with_text=True)
    page = read_page(tmp_path / "a.html")
    atoms, leads = spoken_room.semantics.dictionary, shipped_leads()
    met = atoms + atoms.norm(dim=-1, keepdim=True) * leads.direction
    assert np.allclose(page.dictionary(), met.numpy(), atol=1e-4)
    assert page.header["phrases"]["lead"] == leads.offset
    assert page.scripts["tower"] == asset_path("weights/minilm_l6_v2_rowint8.safetensors").read_bytes()
    tokens = page.scripts["tokens"].decode().split("\n")
    assert len(tokens) == 30522 and tokens.index("[SEP]") == 102
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "MIT License" in text and "TERMS AND CONDITIONS FOR USE, REPRODUCTION, AND DISTRIBUTION" in text


def test_the_text_model_fits_one_space(tmp_path):
    with pytest.raises(InputError, match="'minilm' only, the scene speaks 'none'"):
        pipeline.web_page(bare_scene(random_gaussians(3), "made"), tmp_path / "a.html", with_text=True)
    assert not os.listdir(tmp_path)


def test_a_page_links_to_nothing_and_is_small(tmp_path):
    write_html(bare_scene(random_gaussians(1), "made"), tmp_path / "a.html")
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert read_page(tmp_path / "a.html").addresses == []
    assert "http" not in text.replace("http-equiv", "")
    assert "default-src 'none'" in text
    assert len(text) < 90_000


def test_every_script_is_in_the_page():
    assert {path.stem for path in PAGE.glob("*.js")} == {READING, *SCRIPTS, *LAYERED}


def test_the_page_judges_by_our_numbers():
    text = "".join((PAGE / name).read_text(encoding="utf-8") for name in ("answers.js", "sorting.js"))
    said = {name: float(value) for name, value in re.findall(r"const (\w+) = ([\d.e-]+);", text)}
    ours = {
        "EMPTY_NORM": RELEVANCE.empty_norm, "COVERED_ALPHA": ANSWERING.covered_alpha,
        "TOP_FRACTION": ANSWERING.top_fraction, "MIN_AREA": ANSWERING.min_area, "NEAR": NEAR,
    }  # fmt: skip
    assert {name: said[name] for name in ours} == ours


def test_stops_and_notes_come_along(tmp_path, spoken_room, few):
    """A stop of another lens or of parallel rays shows its subject as large."""
    wide = replace(pose_of(spoken_room), fov=90.0)
    flat = replace(pose_of(spoken_room), span=2.0, reach=5.0)
    notes = (Note("it", Vector(*CHAIR), phrase="cosy seat"), Note("", Vector(0, 0, 1), Vector(0.5, 0, 1)))
    tour = Tour((Stop("Wide", wide, "All of it.", "old lamp"), Stop("Flat", flat)), notes, "Flat")
    toured = spoken_room.with_record(tour=told_tour(tour), metric_scale=2.0)
    moved = replace(toured, viewmats=toured.viewmats.clone())
    moved.viewmats[:, 0, 3] -= 3.0  # the page's origin is elsewhere
    pipeline.web_page(moved, tmp_path / "a.html", ["wall"])
    header = read_page(tmp_path / "a.html").header
    assert header["start"] == 1 and header["metric"] == 2.0 and header["phrases"]["asked"] == 1
    assert header["phrases"]["texts"][:3] == ["wall", "old lamp", "cosy seat"]
    assert [stop["name"] for stop in header["stops"]] == ["Wide", "Flat"]
    origin = np.array(header["origin"])
    assert origin[0] == pytest.approx(3.0)
    assert np.allclose(np.array(header["notes"][0]["at"]) + origin, CHAIR)
    half = np.tan(np.radians(60) / 2)  # of the page's lens
    for stop, pose, across in zip(header["stops"], (wide, flat), (wide.reach, 1.0), strict=True):
        pivot = np.array(stop["eye"]) + stop["distance"] * np.array(stop["turn"][2])
        assert np.allclose(pivot + origin, pose.pivot) and np.allclose(stop["turn"], pose.axes.T)
        assert stop["distance"] * half == pytest.approx(across)  # half of what is seen at the pivot


def pose_of(scene: Scene) -> Pose:
    return from_view(scene.viewmats[0].numpy(), scene.Ks[0].numpy(), scene.view_size, 1.2)


def test_a_page_of_several_scenes_asks_all_the_same(tmp_path, spoken_room, few):
    fewer = spoken_room.rows(torch.arange(3000))
    pipeline.web_page(spoken_room, tmp_path / "a.html", ["lamp"], beside={"the other": fewer})
    first, second = (read_page(tmp_path / "a.html", number) for number in (0, 1))
    assert second.header["title"] == "the other" and second.header["count"] == 3000
    assert first.header["phrases"]["texts"] == second.header["phrases"]["texts"]
    assert "shaders" in first.header and "shaders" not in second.header
    assert (tmp_path / "a.html").read_text().count("<script>") == 1
    mute = bare_scene(random_gaussians(3), "made")
    with pytest.raises(InputError, match="one language, not minilm, none"):
        pipeline.web_page(spoken_room, tmp_path / "b.html", beside={"mute": mute})
    pipeline.web_page(mute, tmp_path / "c.html", beside={"as mute": mute})
    assert "phrases" not in read_page(tmp_path / "c.html", 1).header
