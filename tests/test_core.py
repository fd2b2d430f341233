"""What is counted of the core: each kind is seen where it is, and nothing else is taken for it."""

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
    return turned(values * 7)
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
    for path, text in {"pipeline": PIPELINE, "other": OTHER, "deep": DEEP, "lab/train": OTHER}.items():
        file = tmp_path / "langflash_core" / f"{path}.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    found = counts(tmp_path)
    of = {name: list(held) for name, held in found.items() if isinstance(held, list)}
    core = "langflash_core"
    assert of["numbers named in modules"] == [f"{core}.other._TWO", f"{core}.other.SIZES"]
    assert found["numbers in bodies, but 0, 1, 2"] == 1 and found["functions"] == 8
    assert of["modules at the root"] == ["deep", "other", "pipeline"]
    assert of["reprojections"] == [f"{core}.deep.look", f"{core}.deep.turned"]
    assert of["neighbour rules"] == [f"{core}.deep.near", f"{core}.deep.pairs"]
    assert of["bare participles"] == [
        f"{core}.deep.turned",
        f"{core}.other.helped",
        f"{core}.pipeline.Kept.told",
    ]
    assert of["rooms"] == [f"{core}.deep", f"{core}.other", f"{core}.pipeline"]
    assert found["returns"] == 2  # back into deep from other, and back to the pipeline's own class
