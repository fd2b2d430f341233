"""Tours, notes, plans and pages of several scenes in a real browser, from the disk without a network; pages
in pages, by the snippet that the guide has."""

import html as html_escapes
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import langflash_core as lf
from langflash_core import pipeline
from langflash_core.geometry.poses import Vector, from_view, orbit
from langflash_core.language.spaces import language_space
from langflash_core.scene.tour import Note, Stop, Tour, told_tour
from langflash_core.showing.notebook import Cell, camera_from, page_of
from langflash_core.types import Gaussians, Scene
from tests.app.window.scenes import CHAIR, PHRASES, room
from tests.export.browser import Browser, needs_browser
from tests.export.test_html_in_browser import place, until

pytestmark = needs_browser
GUIDE = Path(__file__).resolve().parents[2] / "GUIDE.md"
FRONT = Vector(CHAIR[0], CHAIR[1], CHAIR[2] - 0.2)
BEHIND = Vector(CHAIR[0], CHAIR[1], 1.3)  # on the wall


@pytest.fixture(scope="module")
def scene() -> Scene:
    plain = room(language_space("minilm").encode(PHRASES))
    first = from_view(plain.viewmats[0].numpy(), plain.Ks[0].numpy(), plain.view_size, 1.0)
    notes = (
        Note("The block", FRONT, phrase="armchair"),
        Note("Hidden", BEHIND),
        Note("Width", Vector(-0.3, 0.1, 0.6), Vector(0.0, 0.1, 0.6)),
    )
    tour = Tour(
        (Stop("Ahead", first, "The whole of it."), Stop("Aside", orbit(first, 0.4, 0.0), phrase="wall")),
        notes,
        "Ahead",
    )
    return plain.with_record(tour=told_tour(tour), metric_scale=2.0)


@pytest.fixture(scope="module")
def file(scene, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("pages") / "tour.html"
    few = replace(scene.rows(torch.arange(2500)), record=replace(scene.record, tour={}))  # the block alone
    pipeline.web_page(scene, path, ["armchair"], title="tour", beside={"the block": few})
    return path


@pytest.fixture
def opened(page, file):
    page.show(file, (640, 440))
    yield page
    assert page.requests == [file.resolve().as_uri()]


def told(page: Browser) -> str:
    return page.value("document.getElementById('told').textContent")


def test_it_opens_at_its_start_and_goes_on_by_hand_and_key(opened):
    assert np.allclose(place(opened), 0, atol=1e-6) and told(opened) == "AheadThe whole of it."
    opened.value("document.getElementById('next').click()")
    until(opened, "langflash.then((page) => page.moving.flight === null)")
    assert told(opened) == "Aside" and np.linalg.norm(place(opened)) > 0.2
    assert opened.value("document.querySelector('#chips [aria-pressed=true]').textContent").startswith("wall")
    opened.key("PageUp")
    until(opened, "langflash.then((page) => page.moving.flight === null)")
    assert np.allclose(place(opened), 0, atol=1e-6)
    opened.key("t", "KeyT", "t")
    assert opened.value("document.getElementById('play').getAttribute('aria-label')") == "stop the tour"
    opened.drag((480, 300), (500, 300))
    assert opened.value("document.getElementById('play').getAttribute('aria-label')") == "play the tour"


def test_one_arrives_where_frames_come_late(opened):
    """A full picture was drawn before each of them, and the clock of the flight began anew."""
    late = "window.requestAnimationFrame = (next) => setTimeout(() => next(performance.now()), 400)"
    opened.value(f"void ({late})")
    opened.value("document.getElementById('next').click()")
    until(opened, "langflash.then((page) => page.moving.flight === null)", 30)  # a tenth of it is needed
    assert told(opened) == "Aside" and np.linalg.norm(place(opened)) > 0.2
    until(opened, "langflash.then((page) => page.waiting === null && page.sharp)", 30)


def test_notes_hide_behind_what_is_before_them_and_the_keyboard_reaches_them(opened):
    away = "[...document.querySelectorAll('#notes li')].map((item) => item.classList.contains('away'))"
    until(opened, f"String({away}) === 'false,true,false'")
    texts = opened.value("[...document.querySelectorAll('.note')].map((note) => note.textContent)")
    assert texts == ["The block", "Hidden", "Width · 60 cm"]
    x, y = opened.value("(({x, y}) => [x, y])(document.querySelector('.note').getBoundingClientRect())")
    at = opened.value(
        "langflash.then((p) => pixelOf)".replace("pixelOf", "p.notes.labels[0].item.style.transform")
    )
    assert [float(v) for v in re.findall(r"[\d.]+", at)][:2] == pytest.approx([x + 7, y + 14], abs=1)
    opened.value("document.querySelectorAll('.note')[0].click()")
    assert opened.value("document.querySelector('#chips [aria-pressed=true]').textContent").startswith(
        "armchair"
    )
    until(opened, "langflash.then((page) => page.moving.flight === null)")
    until(opened, f"({away})[1]")
    opened.value("document.querySelectorAll('.note')[1].focus()")  # it flies there from the next frame on
    x, y, z = np.array(BEHIND) / np.linalg.norm(BEHIND)
    towards = f"page.orbit.turn[2][0] * {x} + page.orbit.turn[2][1] * {y} + page.orbit.turn[2][2] * {z}"
    until(opened, f"langflash.then((page) => Math.abs({towards} - 1) < 1e-3)")
    opened.key("n", "KeyN", "n")
    assert opened.value("getComputedStyle(document.getElementById('notes')).display") == "none"


def light(gaussians: Gaussians, eye: np.ndarray, point: np.ndarray) -> float:
    """The slow twin of the page's: by covariances, in float64."""
    from langflash_core.geometry.quaternions import quats_to_matrices

    far = np.linalg.norm(point - eye)
    way = (point - eye) / far
    passes = 1.0
    turns = quats_to_matrices(gaussians.quats.double()).numpy()
    rows = zip(
        gaussians.means.double().numpy(),
        turns,
        gaussians.scales.double().numpy(),
        gaussians.opacities.double().numpy(),
        strict=True,
    )
    for mean, turn, scales, opacity in rows:
        if not 0.01 <= (mean - eye) @ way <= 0.97 * far:
            continue
        precision = turn @ np.diag(scales**-2) @ turn.T
        t = (mean - eye) @ precision @ way / (way @ precision @ way)
        off = eye + t * way - mean
        passes *= 1 - opacity * np.exp(-0.5 * off @ precision @ off)
    return float(passes)


def test_what_passes_is_what_the_formula_says(page, tmp_path):
    """To .02: what is farther than three deviations does not count, and numbers are stored in 8 bits."""
    from langflash_core.scene.bare import bare_scene
    from tests.export.splats import random_gaussians

    some = random_gaussians(300)
    scene = replace(bare_scene(some, "made"), view_ids=torch.zeros(300, dtype=torch.int64))
    pipeline.web_page(scene, tmp_path / "some.html")
    page.show(tmp_path / "some.html", (320, 240))
    from tests.export.pages import read_page

    read = read_page(tmp_path / "some.html")
    origin, stored = np.array(read.header["origin"]), read.gaussians()
    for point in stored.means[::60].numpy():
        script = f"langflash.then((page) => page.world.light([0, 0, 0], {(point - origin).tolist()}))"
        assert page.value(script) == pytest.approx(light(stored, origin, point), abs=0.02)


def test_the_plan_shows_what_is_below_the_eyes_and_leads_to_stops(opened):
    opened.key("p", "KeyP", "p")
    until(opened, "document.getElementById('plan').hidden === false")
    pixels = "document.getElementById('above').getContext('2d').getImageData(0, 0, 440, 440).data"
    alphas = opened.value(f"[...{pixels}].filter((_, at) => at % 4 === 3)")
    covered = np.array(alphas).reshape(440, 440) > 128
    # The floor and the block, and nothing where the photos were taken.
    assert 0.05 < covered.mean() < 0.95 and not covered[-20:].any()
    assert opened.value("document.getElementById('metre').hidden") is False
    opened.value("document.querySelectorAll('#marks button')[1].click()")
    until(opened, "langflash.then((page) => page.moving.flight === null)")
    assert told(opened) == "Aside"
    opened.key("p", "KeyP", "p")
    assert opened.value("document.getElementById('plan').hidden") is True


def test_scenes_of_one_page_are_asked_the_same(opened):
    until(opened, "document.querySelectorAll('#rooms [data-state=pending]').length === 0")
    states = "[...document.querySelectorAll('#rooms button')].map((each) => each.dataset.state).join()"
    assert opened.value("langflash.then((page) => page.rooms)") is None
    until(opened, f"{states} === 'found,found'")
    opened.value("document.getElementById('box').focus()")
    opened.type("wall")
    opened.key("Enter")
    until(opened, f"{states} === 'found,missing'")
    opened.value("document.querySelectorAll('#rooms button')[1].click()")
    assert opened.value("document.title") == "the block"
    assert opened.value("document.getElementById('tour').hidden") is True
    until(
        opened,
        "[...document.querySelectorAll('.chip')].map((c) => c.dataset.state).join() === 'found,missing'",
    )


@pytest.mark.parametrize("size", [(390, 844), (1280, 800)])
def test_nothing_sticks_out_and_everything_has_a_name(page, file, size):
    page.show(file, size, "#plan", touch=size[0] < 500)
    assert page.value("document.documentElement.scrollWidth") <= size[0]

    def box(name: str) -> list[float]:
        found = f"document.getElementById('{name}').getBoundingClientRect()"
        return page.value(f"(({{left, top, right, bottom}}) => [left, top, right, bottom])({found})")

    bar, asking = box("tour"), box("ask")
    assert bar[2] <= size[0] and (bar[3] <= asking[1] or asking[2] <= bar[0]), (
        "the tour's bar is over the box"
    )
    nameless = "(each) => !each.hidden && !(each.textContent.trim() || each.ariaLabel)"
    assert page.value(f"[...document.querySelectorAll('button, input')].filter({nameless}).length") == 0
    assert page.value("document.getElementById('told').ariaLive") == "polite"
    if size[0] < 500:
        small = "[...document.querySelectorAll('#tour button')].filter((b) => b.offsetHeight < 44).length"
        assert page.value(small) == 0


def snippet(source: str) -> str:
    """The guide's, with another page."""
    (found,) = re.findall(r"```html\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    assert 'src="room.html"' in found
    return found.replace('src="room.html"', f'src="{source}"')


_HEARD = "heard.map(({ langflash }) => langflash)"


def test_the_snippet_of_the_guide_embeds_a_page_that_tells_and_obeys(page, file, scene):
    outside = file.with_name("outside.html")
    listening = "<script>heard = []; addEventListener('message', ({ data }) => heard.push(data));</script>"
    outside.write_text(f"<!doctype html><title>out</title>{listening}{snippet(file.name)}")
    page.open(outside, (640, 480))
    until(page, f"{_HEARD}.includes('answers') && {_HEARD}.includes('camera')")
    camera = page.value("heard.findLast(({ langflash }) => langflash === 'camera')")
    found = lf.query(scene, "armchair", camera=camera_from(camera))
    answers = page.value("heard.findLast(({ langflash }) => langflash === 'answers').answers")
    assert answers[0]["phrase"] == "armchair" and answers[0]["found"] == found.answers[0].found is True
    send = "document.querySelector('iframe').contentWindow.postMessage({}, '*'), 1"
    page.value(send.replace("{}", json.dumps({"langflash": "go", "stop": "Aside"})))
    until(page, f"{_HEARD}.includes('stop')")
    camera["viewmat"][0][3] = -0.25
    page.value(send.replace("{}", json.dumps({"langflash": "go", "camera": camera})))
    until(
        page,
        "Math.abs(heard.findLast(({ langflash }) => langflash === 'camera').viewmat[0][3] + 0.25) < 1e-6",
    )


def test_a_cell_of_a_notebook_shows_the_page(page, scene, tmp_path):
    """Without anywidget: the page in an iframe, whose text is escaped once and no more."""
    cell = Cell(page_of(scene, ["armchair"], detail="normal", title="cell"), 400)
    outside = tmp_path / "cell.html"
    outside.write_text(f"<!doctype html>{cell._repr_html_()}", encoding="utf-8")
    assert html_escapes.unescape(cell._repr_html_().partition('srcdoc="')[2]).startswith(cell.page)
    page.open(outside, (700, 480))
    heard = "window.heard ??= (addEventListener('message', ({ data }) => (window.heard = data)), null)"
    until(page, f"({heard}) !== null")
