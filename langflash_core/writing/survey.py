"""A list of phrases asked of many scenes: one table of answers, the surest first, with a picture each.

Idea: a phrase is asked in a few of a scene's photos' views, and the view that answers it best speaks for the
scene. One scene is in memory at a time; pictures go to the folder as they are made.
"""

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from langflash_core.base.colormaps import HeatColours
from langflash_core.base.files import make_folder, write_atomically
from langflash_core.base.picture_files import encoded
from langflash_core.errors import InputError
from langflash_core.export.answers import answer_fields, file_names
from langflash_core.export.png import USUAL, heat_over, to_8bit
from langflash_core.language.relevance import Mode
from langflash_core.pipeline import query
from langflash_core.types import Camera, Frame, PromptAnswer, QueryResult, Scene
from langflash_core.writing.job import kept_of, plural

MOST_VIEWS = 4
"""Of a scene, evenly among its photos: each takes as long as a query."""
PICTURES, TABLE, DOCUMENT, PAGE = "pictures", "answers.csv", "answers.json", "index.html"
COLUMNS = (
    "phrase", "scene", "found", "score", "threshold", "view", "photo", "area", "x", "y", "z",
    "size_x", "size_y", "size_z", "unit", "picture",
)  # fmt: skip


@dataclass(frozen=True)
class Reply:
    """What one scene says of one phrase, in its best view. picture: relative to the folder."""

    scene: str
    answer: PromptAnswer
    view: int
    photo: str
    metres: float | None
    picture: str

    @property
    def fields(self) -> dict[str, Any]:
        """As in `answers.json`."""
        return {
            "scene": self.scene,
            **answer_fields(self.answer, self.metres or 1.0),
            "unit": "m" if self.metres else "scene",
            "view": self.view + 1,  # as people count
            "photo": self.photo,
            "picture": self.picture,
        }


def ask_scene(
    scene: Scene,
    name: str,
    prompts: Sequence[str],
    folder: Path,
    *,
    render: Callable[[Scene, Camera], Frame],
    mode: Mode = "relevancy",
    negatives: Sequence[str] | None = None,
    colours: HeatColours = USUAL,
) -> list[Reply]:
    """Ask a scene and write a picture for each phrase.

    Raises:
        PromptError: a phrase cannot be asked. InputError: the scene has no language. OutputError: a picture
            cannot be written.
    """
    if scene.semantics.num_atoms == 0:
        raise InputError("it has no language; give it one with `langflash lift`")
    best: dict[int, tuple[int, QueryResult]] = {}
    for view in scene.some_views(MOST_VIEWS):
        result = query(scene, prompts, view=view, mode=mode, negatives=negatives, render=render)
        for place, answer in enumerate(result.answers):
            if place not in best or _rank(answer) > _rank(best[place][1].answers[place]):
                best[place] = view, result
    make_folder(folder / PICTURES)
    replies = []
    for place, own in enumerate(file_names([f"{name} {prompt}" for prompt in prompts])):
        view, result = best[place]
        answer, picture = kept_of(result)[place], f"{PICTURES}/{own}.jpg"
        shown = heat_over(result.relevance[place], result.frame.rgb, answer.lit_from, result.mode, colours)
        write_atomically(folder / picture, encoded(to_8bit(shown), "JPEG", quality=88))
        photos = scene.record.photos
        photo = photos[view] if view < len(photos) else ""
        replies.append(Reply(name, answer, view, photo, scene.record.metric_scale, picture))
    return replies


def write_survey(
    replies: Sequence[Reply], left_out: Sequence[tuple[str, str]], folder: Path
) -> dict[str, Any]:
    """Write table, document and page of all replies; the document is given back.

    Args:
        left_out: scenes that could not be asked, and why.

    Raises:
        OutputError: the folder cannot be written.
    """
    ranked = sorted(replies, key=lambda one: _rank(one.answer), reverse=True)
    asked = dict.fromkeys(one.answer.prompt for one in replies)
    phrases = {prompt: [one for one in ranked if one.answer.prompt == prompt] for prompt in asked}
    document = {
        "prompts": [
            {"prompt": prompt, "scenes": [one.fields for one in found]} for prompt, found in phrases.items()
        ],
        "left_out": [{"scene": scene, "why": why} for scene, why in left_out],
    }
    write_atomically(folder / DOCUMENT, (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode())
    write_atomically(folder / TABLE, _table(phrases).encode())
    write_atomically(folder / PAGE, "".join(_page(phrases, left_out)).encode())
    return document


def _rank(answer: PromptAnswer) -> tuple[bool, float]:
    return answer.found, answer.score


def _table(phrases: dict[str, list[Reply]]) -> str:
    stream = io.StringIO()
    table = csv.DictWriter(stream, list[str](COLUMNS), lineterminator="\n")
    table.writeheader()
    for replies in phrases.values():
        table.writerows(_row(one.fields) for one in replies)
    return stream.getvalue()


def _row(fields: dict[str, Any]) -> dict[str, Any]:
    place, box = fields["centroid"] or ("",) * 3, fields["box"]
    size = box["size"] if box else ("",) * 3
    named = dict(zip(("x", "y", "z", "size_x", "size_y", "size_z"), (*place, *size), strict=True))
    rounded = {key: f"{value:.4g}" if value != "" else "" for key, value in named.items()}
    plain = {key: fields[key] for key in ("scene", "view", "photo", "unit", "picture")}
    numbers = {key: f"{fields[key]:.4g}" for key in ("score", "threshold", "area")}
    return {
        "phrase": fields["prompt"],
        "found": "yes" if fields["found"] else "no",
        **plain,
        **numbers,
        **rounded,
    }


_HEAD = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src 'self' file:; style-src 'unsafe-inline'">
<title>{title}</title><style>
:root {{ color-scheme: light dark; }}
body {{ font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 76em; padding: 0 1.2em; }}
h1 {{ font-size: 1.35em; }} h2 {{ font-size: 1.1em; margin: 2em 0 .6em; }}
ul {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(15em, 1fr)); gap: 1em; padding: 0; }}
li {{ list-style: none; }} summary {{ cursor: pointer; opacity: .75; }}
img {{ width: 100%; aspect-ratio: 4 / 3; object-fit: cover; display: block; border-radius: 6px; }}
.sure {{ float: right; font-variant-numeric: tabular-nums; opacity: .75; }}
small {{ display: block; opacity: .75; }}
</style></head><body>
<h1>{title}</h1>
<p>The surest first. <a href="answers.csv">answers.csv</a>, <a href="answers.json">answers.json</a></p>
"""


def _page(phrases: dict[str, list[Reply]], left_out: Sequence[tuple[str, str]]) -> Iterator[str]:
    scenes = len({one.scene for found in phrases.values() for one in found})
    yield _HEAD.format(title=f"{plural(len(phrases), 'phrase')}, {plural(scenes, 'scene')}")
    for prompt, found in phrases.items():
        there = sum(one.answer.found for one in found)
        yield f"<h2>{escape(prompt)}: found in {there} of {len(found)}</h2><ul>\n"
        yield from map(_card, found[:there])
        yield "</ul>\n"
        if there < len(found):
            nearest = f"{found[there].scene} comes nearest, {found[there].answer.score:.2f}"
            yield f"<details><summary>not found in {len(found) - there}; {escape(nearest)}</summary><ul>\n"
            yield from map(_card, found[there:])
            yield "</ul></details>\n"
    if left_out:
        yield "<h2>Left out</h2>\n"
        yield from (f"<p>{escape(scene)}: {escape(why)}</p>\n" for scene, why in left_out)
    yield "</body></html>\n"


def _card(one: Reply) -> str:
    answer = one.answer
    said = "found" if answer.found else "not found"
    words = [said, f"{answer.area:.1%} of the picture"] if answer.found else [said]
    if answer.found and answer.box and one.metres:
        words.append(" x ".join(f"{one.metres * side:.2f}" for side in answer.box["size"]) + " m")
    return (
        f'<li><img loading="lazy" src="{escape(quote(one.picture))}" '
        f'alt="{escape(f"{answer.prompt} in {one.scene}: {said}")}">'
        f'<span class="sure" title="score, from {answer.threshold:.2f} on found">{answer.score:.2f}</span>'
        f"{escape(one.scene)}<small>{escape(', '.join(words))}</small></li>\n"
    )
