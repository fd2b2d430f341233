"""A web page that holds a scene and answers phrases: one file, no network, any browser with WebGL 2.

The page is `page/page.html` with its style, its program and the shaders of `shaders/web/` in it; its
policy lets it load nothing. The scene is a JSON header and one deflate stream in base64: columns of 8 or
16 bits a value, the low and high bytes of the wider ones apart, some as differences from the row before
(of 16 bits: zigzag). Gaussians are stored as in `quantised.py`, their positions around the first view's
camera, at most four weights each in 8 bits. Phrases are numbers per atom, d_k . t, in 16 bits: the page
needs neither dictionary nor text tower, and answers those that it was made with. With a text model it holds
both, deflated as they are, and answers any phrase.

Of a scene of layers the page holds each layer (`page_columns.py`) and draws as `splat/compose.py` has it.

A page may hold several scenes; the first one is shown, and each answers the same phrases. Stops and notes
of a scene's tour come along, cameras with the page's own lens.

Axes and units are the scene's own. What is lost: photos, weights beyond the fourth, and without a text
model the dictionary.
"""

import base64
import hashlib
import html
import json
import math
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.colormaps import HEAT_STOPS
from langflash_core.base.files import write_atomically
from langflash_core.base.graphics import shader_source
from langflash_core.export.packing import check_some, morton_order
from langflash_core.export.page_columns import (
    Column,
    gaussian_columns,
    in_layers,
    layered_columns,
    table_column,
    weight_columns,
)
from langflash_core.export.settings import PAINTING
from langflash_core.geometry.cameras import invert_rigid
from langflash_core.geometry.poses import from_view
from langflash_core.geometry.rotations import turn_of
from langflash_core.scene.exposure import median_distance
from langflash_core.scene.settings import EXPOSURE
from langflash_core.scene.tour import Stop, read_tour
from langflash_core.types import Scene

SCRIPTS = (
    "decode", "cameras", "sorting", "answers", "drawing", "worlds", "moving", "asking", "address", "touring",
    "notes", "plan", "embedding", "page", "alone", "main",
)  # fmt: skip
READING = "words"  # beside a text model
LAYERED = ("layers", "blending")  # instead of "alone", where a scene of the page has layers
_SHADERS = ("splat.vert", "splat.frag", "screen.vert", "show.frag")
_BLENDING = "blend.frag"
_FORMAT, _VERSION = "langflash-page", 1
_SLOT = re.compile(r"<!-- (\w+) -->")
_COMMENT = re.compile(r"^ *//.*\n", re.MULTILINE)  # a line of its own


@dataclass(frozen=True)
class Phrases:
    """What a page answers, over K atoms.

    texts: P phrases, the first `num_asked` of them shown at once. scores (P, K): d_k . t.
    negatives (M, K): d_k . n of what a phrase is compared with. gram (K, K): d_j . d_k.
    temperature, threshold: as of a query in mode relevancy. half: of a score's log odds, from which pixels
    show the phrase; 0: from the threshold on. dictionary (K, C): d_k + |d_k| a, and rivals (V,
    C): names that others are measured against, where phrases t are to be answered that are not among the
    texts; they start with lead + a . t.
    """

    texts: tuple[str, ...]
    num_asked: int
    scores: Tensor
    negatives: Tensor
    gram: Tensor
    temperature: float
    threshold: float
    dictionary: Tensor | None = None
    rivals: Tensor | None = None
    lead: float = 0.0
    half: float = 0.0


@dataclass(frozen=True)
class Beside:
    """Another scene of a page: its title, and its phrases, whose texts are those of the first."""

    scene: Scene
    title: str
    phrases: Phrases | None = None


@dataclass(frozen=True)
class TextModel:
    """MiniLM for a page: weights (a safetensors file), tokens by id, and what its licences ask to be told."""

    weights: bytes
    tokens: tuple[str, ...]
    licence: str


def write_html(
    scene: Scene,
    path: Path,
    *,
    phrases: Phrases | None = None,
    text_model: TextModel | None = None,
    title: str | None = None,
    beside: Sequence[Beside] = (),
) -> None:
    """A page of the scene; without phrases it is looked at only.

    Args:
        beside: other scenes in the same page.
        text_model: reads other phrases in the page; the phrases come with their dictionary.
        title: of the page; None: the file's name.

    Raises:
        OutputError: no Gaussian, or an unwritable path.
    """
    first = Beside(scene, path.stem if title is None else title, phrases)
    scenes = []
    for each in (first, *beside):
        check_some(each.scene.gaussians, path)
        header, payload = _encode(each.scene, each.phrases)
        scenes.append(({**header, "title": each.title}, payload))
    write_atomically(path, _page(scenes, text_model).encode())


def programs(*, reading: bool, layered: bool) -> tuple[str, ...]:
    """The scripts of a page, in order: of one that reads words itself, and of one that holds layers."""
    place = SCRIPTS.index("alone")
    drawn = (*SCRIPTS[:place], *LAYERED, *SCRIPTS[place + 1 :]) if layered else SCRIPTS
    return (READING, *drawn) if reading else drawn


def _page(scenes: Sequence[tuple[dict, bytes]], text_model: TextModel | None) -> str:
    """The whole page; what is put in is not looked through for more places to fill."""
    folder = Path(__file__).parent / "page"

    def source(name: str) -> str:
        return (folder / name).read_text(encoding="utf-8")

    layered = any("layers" in header for header, _ in scenes)
    names = programs(reading=text_model is not None, layered=layered)
    program = _COMMENT.sub("", "\n".join(source(f"{name}.js") for name in names))
    script = f'\n"use strict";\n(() => {{\n{program}}})();\n'
    passes = (*_SHADERS, _BLENDING) if layered else _SHADERS
    shaders = {name: _COMMENT.sub("", shader_source(f"web/{name}")) for name in passes}
    drawn = {"shaders": shaders, "constants": _constants()}
    parts = {
        "title": html.escape(scenes[0][0]["title"]),
        "style": f"<style>\n{source('page.css')}</style>",
        "scenes": "\n".join(
            _json_script(f"header{number or ''}", header if number else {**header, **drawn})
            + _packed_script(f"payload{number or ''}", payload)
            for number, (header, payload) in enumerate(scenes)
        ),
        "text": _text_scripts(text_model),
        "program": f"<script>{script}</script>",
        "policy": _policy(script),
    }
    return _SLOT.sub(lambda slot: parts[slot[1]], source("page.html"))


def _policy(script: str) -> str:
    """What a browser lets the page do: run this program and no other, load nothing, send nothing."""
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; base-uri 'none'; "
        "form-action 'none'"
    )


def _packed_script(name: str, content: bytes) -> str:
    """Bytes, deflated, in base64."""
    packed = base64.b64encode(zlib.compress(content, 9)).decode()
    return f'<script type="text/plain" id="{name}">{packed}</script>'


def _text_scripts(model: TextModel | None) -> str:
    if model is None:
        return ""
    scripts = {"tower": model.weights, "tokens": "\n".join(model.tokens).encode()}
    packed = (_packed_script(name, content) for name, content in scripts.items())
    return "\n".join((*packed, f"<!--\n{model.licence.replace('--', '- -')}\n-->"))


def _json_script(name: str, content: dict) -> str:
    """JSON that no tag can end."""
    text = json.dumps(content, ensure_ascii=True, allow_nan=False).replace("<", "\\u003c")
    return f'<script type="application/json" id="{name}">{text}</script>'


def _constants() -> dict[str, str]:
    """What `show.frag` is given, as GLSL."""
    stops = ", ".join("vec3({})".format(", ".join(f"{part:.3f}" for part in stop)) for stop in HEAT_STOPS)
    shares = {"GLOW": str(PAINTING.glow), "DIM": str(PAINTING.dim)}
    return {**shares, "STOPS": str(len(HEAT_STOPS)), "HEAT_STOPS": stops}


def _encode(scene: Scene, phrases: Phrases | None) -> tuple[dict, bytes]:
    """Header and columns."""
    origin = invert_rigid(scene.viewmats[0].double())[:3, 3]
    if scene.view_ids is None:  # in no order that says what is near
        scene = scene.rows(torch.from_numpy(morton_order(scene.gaussians.means.double().cpu().numpy())))
    world, (held, books, columns) = scene.record.world, _page_columns(scene, origin)
    header = {
        "format": _FORMAT,
        "version": _VERSION,
        "count": len(scene.gaussians),
        "origin": origin.tolist(),
        "views": _views(scene, origin),
        "viewSize": list(scene.view_size),
        # As the world has it that the scene stands in, else as the first photo was held.
        "down": (scene.viewmats[0, 1, :3] if world is None else turn_of(world)[1]).tolist(),
        **_light(scene),
        **_tour(scene, origin.numpy()),
        **books,
    }
    if phrases is not None:
        header["phrases"] = {
            "texts": list(phrases.texts), "asked": phrases.num_asked, "atoms": len(phrases.gram),
            "temperature": phrases.temperature, "threshold": phrases.threshold,
            "lead": phrases.lead, "half": phrases.half,
        }  # fmt: skip
        columns += weight_columns(held)
        tables = {
            "scores": phrases.scores, "negatives": phrases.negatives, "gram": phrases.gram,
            "dictionary": phrases.dictionary, "rivals": phrases.rivals,
        }  # fmt: skip
        columns += [table_column(name, table, header) for name, table in tables.items() if table is not None]
    header["columns"] = [[c.name, c.values.size, c.width, c.differences] for c in columns]
    return header, b"".join(column.packed() for column in columns)


def _page_columns(scene: Scene, origin: Tensor) -> tuple[Scene, dict, list[Column]]:
    """The scene in the order in which the page holds it; what of the header its Gaussians need, and their
    columns."""
    if not scene.layered or scene.view_ids is None or not bool((scene.view_ids >= 0).any()):
        return scene, *gaussian_columns(scene, origin)
    held = in_layers(scene)
    books, columns = layered_columns(held, origin)
    return held, {**books, "distance": median_distance(scene)}, columns


def _views(scene: Scene, origin: Tensor) -> list[dict]:
    """Each photo's camera: rows of its rotation, its place from the origin, fx, fy, cx, cy in pixels."""
    views = []
    for viewmat, K in zip(scene.viewmats.double(), scene.Ks.double(), strict=True):
        eye = (invert_rigid(viewmat)[:3, 3] - origin).tolist()
        pinhole = [float(value) for value in (K[0, 0], K[1, 1], K[0, 2], K[1, 2])]
        views.append({"turn": viewmat[:3, :3].tolist(), "eye": eye, "pinhole": pinhole})
    return views


def _light(scene: Scene) -> dict:
    """What the light of a place is found by (`scene.exposure`); nothing of photos in one light."""
    light = scene.record.light
    told = {**light, "distance": median_distance(scene), "far": EXPOSURE.far, "here": EXPOSURE.here}
    return {"light": told} if light else {}


def _tour(scene: Scene, origin: np.ndarray) -> dict:
    """Stops as cameras of the page's lens, their subject as large; notes around the origin; metres per
    unit."""
    tour = read_tour(scene.record.tour)
    first = from_view(np.eye(4), scene.Ks[0].double().numpy(), scene.view_size, 1.0)
    told: dict = {"stops": [_stop(stop, first.fov, origin) for stop in tour.stops], "notes": []}
    for note in tour.notes:
        ends = {"at": (np.array(note.at) - origin).tolist()}
        ends |= {} if note.to is None else {"to": (np.array(note.to) - origin).tolist()}
        told["notes"].append({"text": note.text, "phrase": note.phrase, **ends})
    told |= {"start": tour.names.index(tour.start)} if tour.start else {}
    metric = scene.record.metric_scale
    return told | ({"metric": metric} if metric else {})


def _stop(stop: Stop, fov: float, origin: np.ndarray) -> dict:
    pose = stop.pose
    wide, own = (math.tan(math.radians(degrees) / 2) for degrees in (pose.fov, fov))
    distance = pose.distance * wide / own
    eye = pose.pivot - distance * pose.axes[:, 2] - origin
    said = {"name": stop.name, "text": stop.text, "phrase": stop.phrase}
    return {**said, "eye": eye.tolist(), "turn": pose.axes.T.tolist(), "distance": distance}
