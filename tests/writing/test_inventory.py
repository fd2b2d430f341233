"""Inventories as files: tables, a page, and plans that other readers understand."""

import csv
import io
import json
import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import pytest

from langflash_core.base.request import ExportRequest
from langflash_core.export.png import to_8bit
from langflash_core.inventory import inventory
from langflash_core.inventory.plan import floor_plan
from langflash_core.splat import render
from langflash_core.writing import write
from langflash_core.writing.inventory.drawing import plan_svg
from langflash_core.writing.inventory.dxf import plan_dxf
from tests.boxroom import DEEP, METRES, WIDE, box_room

SVG = "{http://www.w3.org/2000/svg}"


def with_photos(scene):
    """The scene with what its cameras see for photos."""
    from PIL import Image

    jpegs = []
    for view in range(scene.num_views):
        stream = io.BytesIO()
        frame = render(scene, scene.camera(view), weight_maps=False)
        Image.fromarray(to_8bit(frame.rgb)).save(stream, "JPEG", quality=90)
        jpegs.append(stream.getvalue())
    return replace(scene, photos=tuple(jpegs))


@pytest.fixture(scope="module")
def room():
    names = {"table 1": 'Tisch <Ü> & "Co"'}
    return with_photos(box_room()).with_record(metric_scale=METRES, thing_names=names)


@pytest.fixture(scope="module")
def folder(room, tmp_path_factory):
    """Every file of it."""
    place = tmp_path_factory.mktemp("inventory")
    for name, what in (
        ("room.html", "inventory"), ("room.csv", "inventory"), ("room.json", "inventory"), ("room.svg", None),
        ("room.dxf", None),
    ):  # fmt: skip
        write(room, ExportRequest(place / name, what=what))
    return place


def test_the_table_has_a_row_a_thing(folder):
    rows = list(csv.DictReader(io.StringIO((folder / "room.csv").read_text(encoding="utf-8"))))
    assert sorted(row["kind"] for row in rows) == ["chair", "chair", "door", "table"]
    (table,) = (row for row in rows if row["kind"] == "table")
    assert table["name"] == 'Tisch <Ü> & "Co"' and table["id"] == "table 1" and table["unit"] == "m"
    assert float(table["width"]) == pytest.approx(1.4, abs=0.12) and table["guessed"] == "False"


def test_the_document_has_things_walls_and_how_they_are_known(folder):
    said = json.loads((folder / "room.json").read_text(encoding="utf-8"))
    assert said["counts"]["chair"] == 2 and said["unit"] == "m" and said["guess"] is None
    lengths = sorted(math.dist(wall["start"], wall["end"]) for wall in said["plan"]["walls"])
    assert lengths == pytest.approx([WIDE, DEEP, DEEP], abs=0.2)
    assert said["world"]["floor_by"] == "floor" and len(said["plan"]["openings"]) == 1


def test_the_plan_is_to_scale_on_paper(folder):
    drawing = ET.parse(folder / "room.svg").getroot()
    box = [float(value) for value in drawing.get("viewBox", "").split()]
    assert drawing.get("width") == f"{box[2]:.1f}mm"  # a unit of the drawing is a millimetre
    (said,) = re.findall(r"1 : (\d+)", "".join(drawing.itertext()))
    ratio = int(said)
    walls = [line for line in drawing.iter(f"{SVG}line") if line.get("class") == "wall"]
    ends = [[float(line.get(name, "nan")) for name in ("x1", "y1", "x2", "y2")] for line in walls]
    metres = sorted(math.dist(end[:2], end[2:]) / 1000 * ratio for end in ends)
    assert metres == pytest.approx([WIDE, DEEP, DEEP], abs=0.2)
    assert 'Tisch <Ü> & "Co"' in "".join(drawing.itertext())
    badges = [
        (float(mark.get("cx", "nan")), float(mark.get("cy", "nan")))
        for mark in drawing.iter(f"{SVG}circle")
        if mark.get("class") == "badge"
    ]
    assert min(math.dist(a, b) for k, a in enumerate(badges) for b in badges[:k]) > 3  # none covers another


def test_what_is_doubted_is_drawn_so_and_says_why():
    plan = floor_plan(inventory(box_room().with_record(metric_scale=METRES)))
    assert "oubt" not in plan_svg(plan, "Room").partition("</style>")[2]
    wall = replace(plan.walls[0], doubt="it is short")
    doubted = replace(plan, walls=(wall, *plan.walls[1:]), astray=frozenset({"table 1"}))
    drawn = plan_svg(doubted, "Room").partition("</style>")[2]
    assert "Perhaps no wall: it is short" in drawn and drawn.count('class="doubt"') == 1
    assert "table 1: it goes through a wall" in drawn and ">table 1?<" in drawn
    assert ">dashed: perhaps no wall; grey, ?: in doubt<" in drawn
    told = plan_svg(replace(doubted, eyes=((0.0, 0.0),)), "Room")  # in one line, for none to lie on another
    assert ">where the photos were taken; dashed: perhaps no wall; grey, ?: in doubt<" in told
    assert "DOUBTED\n10\n" in plan_dxf(doubted)


def test_the_plan_for_cad_has_every_wall_and_thing_on_its_layer(folder):
    lines = (folder / "room.dxf").read_bytes().decode("ascii").splitlines()
    assert len(lines) % 2 == 0
    pairs = [(int(code), value) for code, value in zip(lines[::2], lines[1::2], strict=True)]
    assert pairs[0] == (0, "SECTION") and pairs[-1] == (0, "EOF") and (1, "AC1009") in pairs
    kinds = [value for code, value in pairs if code == 0]
    assert kinds.count("LINE") == 4 and kinds.count("POLYLINE") == 3 and kinds.count("VERTEX") == 12
    assert kinds.count("SECTION") == kinds.count("ENDSEC") == 3
    assert (1, 'Tisch <\\U+00DC> & "Co"') in pairs
    start = next(k for k, pair in enumerate(pairs) if pair == (0, "LINE"))
    wall = dict(pairs[start + 1 : start + 8])
    east, north = (float(wall[b]) - float(wall[a]) for a, b in ((10, 11), (20, 21)))
    assert min(abs(math.hypot(east, north) - true) for true in (WIDE, DEEP)) < 0.2


def test_the_page_needs_nothing_else_and_says_names_as_they_are(folder):
    page = (folder / "room.html").read_text(encoding="utf-8")
    assert "Tisch &lt;Ü&gt; &amp; &quot;Co&quot;" in page and "<Ü>" not in page
    assert not re.search(r"(src|href)=\"(?!data:)", page) and "<script" not in page
    assert page.count('class="picture"><img') == 4 and page.count("data:image/webp;base64,") == 4
    assert "<b>2</b> chair" in page and "1 : " in page


def test_people_count_photos_from_1(folder):
    """In tables as well; indices from 0 are for Python alone."""
    page = (folder / "room.html").read_text(encoding="utf-8")
    seen = {number for cell in re.findall(r'<td class="photos">([^<]*)', page) for number in cell.split(", ")}
    assert seen == {"1", "2"}
    plan = (folder / "room.svg").read_text(encoding="utf-8")
    assert re.findall("<title>Photo (.)</title>", plan) == ["1", "2"]
    assert "where the photos were taken" in plan
    things = json.loads((folder / "room.json").read_text(encoding="utf-8"))["things"]
    assert {view for thing in things for view in thing["photos"]} == {1, 2}


def test_a_scene_of_walls_alone_has_a_plan_and_an_empty_list(tmp_path):
    bare = box_room(chairs=(), table=None).with_record(metric_scale=METRES)
    assert write(bare, ExportRequest(tmp_path / "bare.svg")) == "3 walls, 0 things"
    write(bare, ExportRequest(tmp_path / "bare.html", what="inventory"))
    assert "1 thing" in (tmp_path / "bare.html").read_text(encoding="utf-8")  # the door
