"""Pages in a real browser, opened from the disk without a network: the same pixels, the same answers."""

import base64
import io
import json
import re
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from torch.nn.functional import normalize

import langflash_core as lf
from langflash_core import pipeline
from langflash_core.export.html import write_html
from langflash_core.export.png import heat_over
from langflash_core.language.algebra import encode_prompts
from langflash_core.language.settings import ANSWERING
from langflash_core.language.spaces import language_space
from langflash_core.scene.bare import bare_scene
from langflash_core.scene.exposure import lit_camera
from langflash_core.splat import render
from langflash_core.types import QueryResult, Scene
from tests.app.window.scenes import CHAIR, PHRASES, room
from tests.export.browser import Browser, needs_browser
from tests.export.splats import random_gaussians
from tests.export.test_html import ODD, PAGE, phrases_of
from tests.splat.scenes import cloud
from tests.torture import address

pytestmark = needs_browser

ASKED = ("armchair", "wall", "piano")
LEAST_DB, LEAST_IOU = 30.0, 0.95
TEXT = """const text = (numbers) => {
    const bytes = new Uint8Array(numbers.buffer);
    let letters = "";
    for (let at = 0; at < bytes.length; at += 32768)
      letters += String.fromCharCode(...bytes.subarray(at, at + 32768));
    return btoa(letters);
  };"""
_PICTURE = """langflash.then((page) => {
  TEXT
  const { colours, answer } = page.picture(VIEW, SIZE, PHRASE);
  return { colours: text(colours), ...answer, relevance: answer && text(answer.relevance) };
})"""


@dataclass(frozen=True)
class Drawn:
    """A picture of the page: rgb over black and alpha (H, W); relevance (H, W) and the answer to a phrase."""

    rgb: np.ndarray
    alpha: np.ndarray
    relevance: np.ndarray | None
    score: float
    found: bool


def drawn(page: Browser, view: int, size: tuple[int, int], phrase: str | None = None) -> Drawn:
    """What the page draws of a photo's view."""
    words = {"VIEW": view, "SIZE": list(size), "PHRASE": phrase}
    script = _PICTURE.replace("TEXT", TEXT)
    for name, value in words.items():
        script = script.replace(name, "undefined" if value is None else json.dumps(value))
    found = page.value(script)

    def numbers(name: str, *channels: int) -> np.ndarray:
        content = np.frombuffer(base64.b64decode(found[name]), np.float32)
        return content.reshape(size[1], size[0], *channels)

    colours = numbers("colours", 4)
    relevance = numbers("relevance") if phrase else None
    return Drawn(
        colours[..., :3], colours[..., 3], relevance, found.get("score", 0), found.get("found", False)
    )


def decibels(one: np.ndarray, two: np.ndarray) -> float:
    return float(-10 * np.log10(np.mean((np.clip(one, 0, 1) - np.clip(two, 0, 1)) ** 2) + 1e-12))


def check_answer(page: Browser, ours: QueryResult, view: int) -> None:
    """Pixels to 30 dB; score, finding and, where it is found, the mask to an IoU of .95."""
    (answer,) = ours.answers
    theirs = drawn(page, view, (ours.camera.width, ours.camera.height), answer.prompt)
    assert decibels(theirs.rgb, ours.frame.rgb.numpy()) >= LEAST_DB
    assert theirs.found == answer.found
    assert theirs.score == pytest.approx(answer.score, abs=0.01)
    if answer.found:
        assert theirs.relevance is not None
        mask = (theirs.relevance >= answer.lit_from) & (theirs.alpha >= ANSWERING.covered_alpha)
        expected = ours.masks[0].numpy()
        assert (mask & expected).sum() / (mask | expected).sum() >= LEAST_IOU


def shown(page: Browser) -> np.ndarray:
    """The page's pixels in [0, 1]."""
    return np.asarray(Image.open(io.BytesIO(page.screenshot())).convert("RGB"), np.float64) / 255


def until(page: Browser, expression: str, seconds: float = 90) -> None:
    """Wait for something to become true."""
    deadline = time.monotonic() + seconds
    while not page.value(expression):
        assert time.monotonic() < deadline, f"never true: {expression}"
        time.sleep(0.1)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return room(language_space("minilm").encode(PHRASES))


@pytest.fixture(scope="module")
def file(scene, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("pages") / "the room.html"
    pipeline.web_page(scene, path, ASKED)
    return path


@pytest.fixture
def opened(page, file):
    """The room's page, drawn."""
    page.show(file, (640, 480))
    return page


def test_pixels_and_answers_are_ours(opened, scene, file):
    for view, phrase in ((0, "armchair"), (1, "armchair"), (1, "wall"), (0, "piano")):
        check_answer(opened, lf.query(scene, phrase, view=view), view)
    assert opened.requests == [file.resolve().as_uri()]  # it loads nothing but itself


def test_the_canvas_shows_the_photos_view(page, file, scene):
    background = re.search(r"BACKGROUND = (\[.*?\])", (PAGE / "drawing.js").read_text(encoding="utf-8"))
    assert background is not None
    red, green, blue = json.loads(background[1])
    ours = lf.query(
        scene, "armchair", view=0, render=lambda s, c: render(s, c, background=(red, green, blue))
    )
    page.show(file, scene.view_size, "#bare&mode=photo")
    assert decibels(shown(page), ours.frame.rgb.numpy()) >= LEAST_DB
    page.show(file, scene.view_size, "#bare&ask=armchair")
    heat = heat_over(ours.relevance[0], ours.frame.rgb, ours.answers[0].lit_from, "relevancy")
    assert decibels(shown(page), heat.numpy()) >= LEAST_DB


def test_chips_say_what_is_found(opened):
    until(opened, "document.querySelectorAll('[data-state=pending]').length === 0")
    states = opened.value("[...document.querySelectorAll('.chip')].map((chip) => chip.dataset.state)")
    assert states == ["found", "found", "missing"]


def test_a_phrase_is_completed_and_answered(opened):
    opened.key("/", "Slash", "/")
    until(opened, "document.activeElement.id === 'box'")
    opened.type("flo")
    listed = opened.value("[...document.querySelectorAll('#suggestions li')].map((item) => item.textContent)")
    assert listed[0] == "floor" and all("flo" in text for text in listed)
    opened.key("Enter")
    until(opened, "document.querySelectorAll('.chip[data-state=found]').length === 3")
    assert "floor" in opened.value("document.querySelector('#chips [aria-pressed=true]').textContent")
    assert opened.value("document.getElementById('box').value") == ""
    opened.type("zzz")
    assert "none of them" in opened.value("document.getElementById('note').textContent")
    opened.key("Escape")
    opened.value("document.querySelector('.gone').click()")
    assert opened.value("document.querySelectorAll('.chip').length") == 3


def place(page: Browser) -> np.ndarray:
    return np.array(page.value("langflash.then((page) => page.orbit.eye)"))


def test_mouse_wheel_and_keys_move_the_camera(opened):
    start = place(opened)
    opened.drag((300, 240), (360, 250))
    turned = place(opened)
    assert np.linalg.norm(turned - start) > 0.05
    opened.call("Input.dispatchMouseEvent", type="mouseWheel", x=300, y=240, deltaX=0, deltaY=-100)
    nearer = place(opened)
    assert np.linalg.norm(nearer - turned) > 0.02
    opened.key("1", "Digit1", "1")
    landed = (
        "langflash.then((p) => p.orbit.eye.every((v, i) => Math.abs(v - p.header.views[VIEW].eye[i]) < 1e-6))"
    )
    until(opened, landed.replace("VIEW", "0"))
    assert np.allclose(place(opened), start, atol=1e-6)
    opened.key("2", "Digit2", "2")
    until(opened, landed.replace("VIEW", "1"))


def test_a_double_click_turns_around_what_lies_there(page, file, scene):
    page.show(file, (640, 480), "#bare")
    front = np.array(CHAIR) - (0, 0, 0.2)
    camera = scene.camera(0, 640, 480)
    x, y = (camera.K[:2] @ torch.tensor(front, dtype=torch.float32) / front[2]).tolist()
    for clicks in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            held = {"button": "left", "clickCount": clicks}
            page.call("Input.dispatchMouseEvent", type=kind, x=round(x), y=round(y), **held)
    until(page, "langflash.then((page) => page.moving.flight === null && page.orbit.target[0] < -0.05)")
    target = np.array(page.value("langflash.then((page) => page.orbit.target)"))
    assert np.linalg.norm(target - front) < 0.05


def test_fingers_turn_and_pinch(page, file):
    page.show(file, (390, 844), touch=True)
    start = place(page)
    page.touch([(100, 300)], [(160, 300)])
    turned = place(page)
    assert np.linalg.norm(turned - start) > 0.05
    distance = page.value("langflash.then((page) => page.orbit.distance)")
    page.touch([(150, 300), (250, 300)], [(100, 300), (300, 300)])
    assert page.value("langflash.then((page) => page.orbit.distance)") < 0.8 * distance
    assert page.value("document.documentElement.scrollWidth") == 390  # nothing sticks out


def test_gloss_is_drawn(page, tmp_path):
    """Harmonics of degree 3, and no language: no box to type in."""
    shiny = cloud(800, num_atoms=0, degree=3, dtype=torch.float32)
    shiny = replace(shiny, gaussians=replace(shiny.gaussians, quats=normalize(shiny.gaussians.quats, dim=-1)))
    write_html(shiny, tmp_path / "shiny.html")
    page.show(tmp_path / "shiny.html", (480, 400))
    ours = render(shiny, shiny.camera(0, 480, 400), weight_maps=False)
    assert decibels(drawn(page, 0, (480, 400)).rgb, ours.rgb.numpy()) >= LEAST_DB
    assert page.value("document.getElementById('ask').hidden") is True


def test_photos_are_shown_in_their_own_light(page, tmp_path):
    """At their places, and between them."""
    some = cloud(800, num_atoms=0, degree=1, dtype=torch.float32)
    gaussians = replace(some.gaussians, quats=normalize(some.gaussians.quats, dim=-1))
    viewmats = some.viewmats[:1].repeat(2, 1, 1)
    viewmats[1, 0, 3] += 0.2
    photos = replace(some, gaussians=gaussians, viewmats=viewmats, Ks=some.Ks[:1].repeat(2, 1, 1))
    light = {"gains": [[1.5, 1.4, 1.3], [0.7, 0.6, 0.8]], "offsets": [[0.1, 0.0, 0.1], [-0.2, -0.1, 0.0]]}
    photos = photos.with_record(light=light)
    write_html(photos, tmp_path / "lit.html")
    page.show(tmp_path / "lit.html", (480, 400))
    for view in (0, 1):
        plain = photos.camera(view, 480, 400)
        ours, other = (
            render(photos, of, weight_maps=False).rgb.numpy() for of in (lit_camera(photos, plain), plain)
        )
        theirs = drawn(page, view, (480, 400)).rgb
        assert decibels(theirs, ours) >= LEAST_DB > decibels(theirs, other) + 5
    between = photos.viewmats[0].clone()
    between[0, 3] += 0.1
    camera = lit_camera(photos, replace(photos.camera(0), viewmat=between))
    eye = (photos.viewmats[0, :3, :3].T @ (between[:3, 3] - photos.viewmats[0, :3, 3])).neg().tolist()
    place = json.dumps({"eye": eye, "turn": between[:3, :3].tolist()})
    told = page.value(f"langflash.then((page) => page.drawing.lightAt({place}))")
    assert camera.light is not None and np.allclose(told, camera.light.numpy(), atol=1e-4)


def test_one_gaussian(page, tmp_path):
    one = bare_scene(random_gaussians(3).rows(torch.tensor([1])), "one")  # of opacity 1
    write_html(one, tmp_path / "one.html")
    page.show(tmp_path / "one.html", (320, 240))
    ours = render(one, one.camera(0, 320, 240), weight_maps=False)
    assert float(ours.alphas.max()) > 0.9
    assert decibels(drawn(page, 0, (320, 240)).rgb, ours.rgb.numpy()) >= LEAST_DB


def scores(page: Browser, rows: list[int]) -> list[float]:
    """What the page judges some of its phrases to be."""
    judged = f"[...page.judge({rows}, page.shown(1)).values()].map((answer) => answer.score)"
    return page.value(f"langflash.then((page) => {judged})")


def test_more_phrases_than_a_pass_takes(page, tmp_path):
    """Nine numbers a pass: |f| and eight phrases; each is answered as alone."""
    mixed = cloud(800, num_atoms=5, degree=0, dtype=torch.float32)
    texts = tuple(f"phrase {index}" for index in range(11))
    write_html(mixed, tmp_path / "many.html", phrases=phrases_of(mixed, texts))
    page.show(tmp_path / "many.html", (240, 200))
    together = scores(page, list(range(11)))
    for row in (0, 8, 10):
        assert together[row] == pytest.approx(scores(page, [row])[0], abs=1e-6)


def test_names_are_text(page, tmp_path):
    odd = cloud(50, num_atoms=3, degree=0, dtype=torch.float32)
    write_html(odd, tmp_path / "odd.html", phrases=phrases_of(odd, ODD), title=ODD[1])
    page.show(tmp_path / "odd.html", (640, 480))
    assert page.value("document.title") == ODD[1]
    said = page.value(
        "[...document.querySelectorAll('.chip > button:first-child')].map((each) => each.firstChild.data)"
    )
    assert said == list(ODD)
    assert len(page.requests) == 1


def test_a_browser_without_webgl_says_so(page, file):
    script = "HTMLCanvasElement.prototype.getContext = () => null"
    added = page.call("Page.addScriptToEvaluateOnNewDocument", source=script)["identifier"]
    try:
        page.open(file, (320, 240))
        until(page, "document.getElementById('waiting').textContent.includes('no WebGL 2')")
    finally:
        page.call("Page.removeScriptToEvaluateOnNewDocument", identifier=added)


PHRASES_OF_ALL_KINDS = (
    "armchair", "A Wooden  Chair, please!", "Stühle für Größe", "t-shirt & jeans (blue)", "日本 table",
    "x" * 101 + " door", "unbelievably photosynthesizing houseplants", "sofa + cushion", "chair - armchair",
    "3.5 mm jack", "naïve café\u200b lamp",
)  # fmt: skip


@pytest.fixture(scope="module")
def reading(scene, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("pages") / "reading.html"
    pipeline.web_page(scene, path, ["armchair"], with_text=True)
    return path


def test_the_page_reads_words_as_we_do(page, reading):
    """To a cosine of 1 - 1e-5: the same int8 weights, float32 here and there."""
    page.show(reading, (320, 240))
    page.value("langflash.then((page) => page.learn('something'))")
    read = f"{json.dumps(PHRASES_OF_ALL_KINDS)}.map((each) => [...tower.encode(each)])"
    found = np.array(page.value(f"langflash.then((page) => page.tower).then((tower) => {read})"))
    ours = encode_prompts(language_space("minilm"), PHRASES_OF_ALL_KINDS).numpy()
    assert (found * ours).sum(1) == pytest.approx(np.ones(len(ours)), abs=1e-5)


def test_a_phrase_that_the_vocabulary_lacks_is_answered(page, reading, scene):
    page.show(reading, (640, 480))
    page.value("document.getElementById('box').focus()")
    page.type("comfy old seat")
    page.key("Enter")
    until(page, "document.querySelectorAll('.chip:not([data-state=pending])').length === 2")
    ours = lf.query(scene, '"comfy old seat"', view=0)  # as it stands: pages read no grammar
    check_answer(page, replace(ours, answers=(replace(ours.answers[0], prompt="comfy old seat"),)), 0)
    page.value("document.getElementById('box').focus()")
    page.type("chair - chair")
    page.key("Enter")
    until(page, "document.getElementById('note').textContent.includes('cancels itself out')")


@pytest.mark.parametrize("fragment", ["#view=length", "#view=-1&mode=photo"])
def test_an_address_that_names_no_view_shows_the_first(page, file, fragment):
    """`views["length"]` is there, and no view: the page stayed empty."""
    page.open(file, (200, 150), fragment)
    assert page.value("langflash.then((page) => page.orbit.turn.length)") == 3


def test_an_address_counts_photos_from_1(tmp_path):
    """Addresses of before say `view`, from 0, and mean what they meant."""
    said = {"photo=2": 1, "photo=1": 0, "photo=0": -1, "photo=3": -1, "view=1": 1, "view=0": 0, "view=2": -1}
    script = address.READER.read_text("utf-8")
    with address.browser(tmp_path) as page:
        page.value(f"globalThis.reader = (() => {{ {script}; return readAddress }})(); 0")
        for fragment, view in said.items():
            assert page.value(f"reader({'#' + fragment!r}, 2, [], []).view") == view, fragment


def test_addresses_at_random(tmp_path):
    """`python -m tests.torture address` reads a million."""
    assert address.torture(tmp_path, 2000, seed=4) == []
