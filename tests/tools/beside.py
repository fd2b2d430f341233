"""Two versions of the program beside each other, in what people do in their first minutes.

    python -m tests.tools.beside OUT.png --code OLD --code .

A real X server, real mouse and keys; the program of each folder is seen only on the screen. Each row is a
story, each column a version. Where a version has no such key or button, nothing happens.
"""

import argparse
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from langflash_core.base.resources import asset_path
from tests.tools.journey import LEFT, PHOTOS, TOP, Person, person
from tests.tools.sheet import Shot, write_sheet

OTHERS = [asset_path(f"photos/books_{side}.jpg") for side in ("left", "right")]
SMALL = (800, 500)
THING = (0.45, 0.42)  # of the picture's place: the plant
PLANT = ((0.44, 0.22), (0.44, 0.64))  # its ends
AROUND = ((0.3, 0.25), (0.44, 0.18), (0.6, 0.3), (0.58, 0.56), (0.42, 0.7), (0.3, 0.5), (0.31, 0.27))
Story = tuple[str, Callable[[Person], None]]


def at(someone: Person, place: tuple[float, float]) -> tuple[str, str]:
    """A place of the picture, in pixels of the screen."""
    width, height = someone.size
    return str(round(LEFT + place[0] * (width - LEFT))), str(round(TOP + place[1] * (height - TOP - 32)))


def press(*keys: str) -> Callable[[Person], None]:
    """Keys, one after the other."""

    def act(someone: Person) -> None:
        for key in keys:
            someone.do("key", key)
            time.sleep(0.7)

    return act


def point_with(key: str) -> Callable[[Person], None]:
    """A tool by its key, then a click on the plant."""

    def act(someone: Person) -> None:
        press("Escape", key)(someone)
        someone.do("mousemove", *at(someone, THING), "sleep", "0.3", "click", "1")

    return act


def draw_around(someone: Person) -> None:
    """The lasso's key, then a line around the plant."""
    press("Escape", "l")(someone)
    someone.do("mousemove", *at(someone, AROUND[0]), "sleep", "0.3", "mousedown", "1")
    for place in AROUND[1:]:
        someone.do("sleep", "0.2", "mousemove", *at(someone, place))
    someone.do("sleep", "0.2", "mouseup", "1")


def measure(someone: Person) -> None:
    """The ruler's key, then a click on both ends of the plant."""
    press("Escape", "t")(someone)
    for place in PLANT:
        someone.do("mousemove", *at(someone, place), "sleep", "0.3", "click", "1", "sleep", "0.5")


def look_for_photos(someone: Person) -> None:
    """A folder's path in what Ctrl+O opens."""
    press("ctrl+o")(someone)
    someone.do("type", "--delay", "40", str(PHOTOS[0].parent))
    press("Return")(someone)


def type_plant(someone: Person) -> None:
    press("Escape", "Escape")(someone)
    someone.rest()
    someone.type("plant")


def drop_others(someone: Person) -> None:
    press("Escape")(someone)
    someone.drop(OTHERS)


WITH_SCENE: tuple[Story, ...] = (
    ("8. What the scene knows, as chips and names", lambda someone: None),
    ("6. Ctrl+P: every command by its name", press("ctrl+p")),
    ("12. C and a click take the whole thing", point_with("c")),
    ("12. L draws a lasso", draw_around),
    ("12. Y: a gizmo moves the selection", press("y")),
    ("12. Ctrl+T recolours it", press("ctrl+t")),
    ("12. M, M: key frames of a camera's path", press("Escape", "ctrl+d", "m", "m")),
    ("12. T: the ruler", measure),
    ("12. Num 7: from above", press("Escape", "v", "KP_7")),
    ("12. Ctrl+M: a scene to merge", press("h", "ctrl+m")),
    ("9. What is this: names to correct", point_with("x")),
    ("4. Ctrl+E: a name of its own for each kind", press("Escape", "ctrl+e")),
    ("10. 'plant': gradation, a legend, colours for all eyes", type_plant),
    ("3. Everything deleted: what the phrase says", press("Escape", "Escape", "ctrl+a", "Delete")),
    ("2. Photos of another room are dropped", drop_others),
)


def stories(code: Path) -> Iterator[Shot]:
    """Each story's screen in one version."""
    with person(code=code) as someone:
        someone.until_first_frame()
        yield Shot("11. The empty window", someone.rest())
        look_for_photos(someone)
        yield Shot("11. Ctrl+O and a folder's path", someone.rest())
    with person(words=tuple(map(str, PHOTOS)), code=code) as someone:
        someone.until_first_frame()
        time.sleep(3.0)
        press("Escape")(someone)
        yield Shot("5. Escape while the network works", someone.rest())
    with person(words=tuple(map(str, PHOTOS)), code=code) as someone:
        someone.until_first_frame()
        someone.until(lambda: "living_room_left" in someone.title(), "the scene")
        for caption, act in WITH_SCENE:
            someone.rest()
            act(someone)
            yield Shot(caption, someone.rest())
    with person(SMALL, tuple(map(str, PHOTOS)), code) as someone:
        someone.until_first_frame()
        someone.until(lambda: "living_room_left" in someone.title(), "the scene")
        press("ctrl+a")(someone)
        small = someone.rest()
        full = np.zeros((800, 1280, 3), np.uint8)
        full[: SMALL[1], : SMALL[0]] = small
        yield Shot("7. A selection at 800 x 500", full)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("sheet", type=Path)
    parser.add_argument("--code", type=Path, action="append", required=True)
    given = parser.parse_args()
    versions = [list(stories(code.resolve())) for code in given.code]
    rows = [shot for row in zip(*versions, strict=True) for shot in row]
    write_sheet(rows, given.sheet, columns=len(versions), width=640, numbered=False)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
