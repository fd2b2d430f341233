"""What is counted of the core: each kind is seen where it is, and nothing else is taken for it."""

from pathlib import Path

from tests.tools.core import counts

PIPELINE = """
from langflash_core.deep import look
from langflash_core.other import helped

def reconstruct(photos):
    helped(look(photos))
    return Kept().told()

class Kept:
    def told(self): ...
"""
OTHER = """
from langflash_core.deep import turned
_TWO, WORD = 2, "two"
SIZES: tuple = (1.5, -3)
HELD = None

def helped(values, few=4):
    return turned(values * 7).lift()
"""
FAR = """
class Lifter:  # who lifts is not known to be one: nobody on the way imports it
    def lift(self): ...
"""
DEEP = """
from langflash_core.geometry.cameras import project as seen_at

def look(points):
    return seen_at(points)

def turned(points, K, R):
    return points @ R / points[2] * K[0, 0] + K[0, 2]

def near(view, viewmats) -> list[int]: ...
def pairs(viewmats) -> list[tuple[int, int]]: ...
def order(viewmats) -> list[int]: ...
"""


def test_each_kind_is_counted(tmp_path):
    texts = {"pipeline": PIPELINE, "other": OTHER, "deep": DEEP, "far": FAR, "lab/train": OTHER}
    for path, text in texts.items():
        file = tmp_path / "langflash_core" / f"{path}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    found = counts(tmp_path)
    of = {name: list(held) for name, held in found.items() if isinstance(held, list)}
    core = "langflash_core"
    assert of["numbers named in modules"] == [f"{core}.other._TWO", f"{core}.other.SIZES"]
    assert of["reprojections"] == [f"{core}.deep.look", f"{core}.deep.turned"]
    assert of["neighbour rules"] == [f"{core}.deep.near", f"{core}.deep.pairs"]
    assert of["rooms"] == ["deep", "other"]
    assert found["returns"] == 1  # back into deep from other


GEOMETRY = "rig cameras depth surface geometry reconstruction network"


def test_the_way_of_a_photo_says_each_thing_once():
    """Where points lie in a photo, and which photos go together, is said in `geometry.pinhole` and `rig`: but
    for a look-up in normalised coordinates, the layers that a camera sees, and who holds points of a photo.
    Numbers that decide something are in records: at most 70 names outside, most of them sizes of nets. From
    photos to a scene one gets back at most 15 times into a folder that one had left."""
    found = counts(Path(__file__).parents[1])
    assert found["reprojections"] == ["langflash_core.cameras.inputs.depths_at"]
    assert found["neighbour rules"] == [
        "langflash_core.geometry.nearness.Nearness.chosen",
        "langflash_core.surface.view_selection._holders",
    ]
    names = found["numbers named in modules"]
    assert isinstance(names, list)
    own = [name for name in names if name.split(".")[1] in GEOMETRY.split() and ".semantics." not in name]
    assert len(own) <= 70
    assert isinstance(found["returns"], int) and found["returns"] <= 15
