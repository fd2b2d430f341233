"""Steps that are kept: once made, found again; damaged or of other settings, made anew."""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import langflash_core as lf
from langflash_core.base.keeping import Keep, forget
from langflash_core.base.records import FoundFocal, FoundLens
from langflash_core.base.resources import asset_path
from langflash_core.cameras.keypoints import KeyPoints
from langflash_core.errors import Cancelled, OutputError
from langflash_core.images.pictures import read_pictures
from langflash_core.images.views import load_views
from langflash_core.network import GuidedDepthNet
from langflash_core.reconstruction.finding import arrays_of, keep_of, prediction_of
from langflash_core.types import Gaussians, Prediction

PHOTOS = [asset_path("photos/books_left.jpg"), asset_path("photos/books_right.jpg")]


def test_a_step_is_made_once(tmp_path: Path):
    made = []

    def make():
        made.append(1)
        return {"values": np.arange(5) * len(made)}

    keep = Keep.of(tmp_path / "new", {"size": 3}, [b"photo"])
    first, second = keep("depth-0", make), keep("depth-0", make)
    assert len(made) == 1 and np.array_equal(first["values"], second["values"])
    keep("depth-1", make)
    assert len(made) == 2 and keep.found == ["depth-0"]
    for other in (
        Keep.of(keep.folder, {"size": 4}, [b"photo"]),
        Keep.of(keep.folder, {"size": 3}, [b"other"]),
    ):
        other("depth-0", make)
    assert len(made) == 4
    forget(keep.folder)
    assert not keep.folder.exists()


def packed_otherwise(offset: int, value: int) -> Callable[[bytes], bytes]:
    """Damage to a number of the archive's directory."""

    def damage(whole: bytes) -> bytes:
        content = bytearray(whole)
        content[content.index(b"PK\x01\x02") + offset] |= value
        return bytes(content)

    return damage


def an_array(_: bytes) -> bytes:
    np.save(stream := io.BytesIO(), np.ones(3))
    return stream.getvalue()


DAMAGES = {
    "empty": lambda _: b"",
    "no archive": lambda _: b"no archive",
    "cut": lambda whole: whole[: len(whole) // 2],
    "encrypted": packed_otherwise(8, 1),
    "unknown packing": packed_otherwise(10, 99),
    "array": an_array,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_step_is_made_again(tmp_path: Path, damage: str):
    keep = Keep.of(tmp_path, {})
    keep("step", lambda: {"values": np.arange(1000)})
    (path,) = tmp_path.iterdir()
    path.write_bytes(DAMAGES[damage](path.read_bytes()))
    assert np.array_equal(keep("step", lambda: {"values": np.ones(2)})["values"], np.ones(2))
    assert len(list(tmp_path.iterdir())) == 1


def test_other_files_of_the_folder_stay(tmp_path: Path):
    (tmp_path / "mine.txt").write_text("mine")
    Keep.of(tmp_path, {})("step", lambda: {"values": np.ones(2)})
    forget(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="in the way"):
        Keep.of(tmp_path / "file", {})("step", lambda: {"values": np.ones(2)})


def test_a_prediction_comes_back_to_the_same_bits():
    torch.manual_seed(0)
    given = Prediction(
        gaussians=Gaussians.none(), weights=torch.rand(2, 3, 4, 5).half(), dictionary=torch.rand(3, 6),
        space="minilm", viewmats=torch.rand(2, 4, 4), depths=torch.rand(2, 4, 5),
        confidences=torch.rand(2, 4, 5), unplaced=(1,), warnings=("dark",), timings={"depth": 1.5},
        Ks=torch.rand(2, 3, 3), lenses=(FoundLens(61.0, 0.5, 4, 65.0, False),),
        bent=(None, FoundFocal(1.1, 0.01, 5, -0.05, 0.002)),
    )  # fmt: skip
    back = prediction_of(arrays_of(given))
    for name in ("weights", "dictionary", "viewmats", "depths", "confidences", "Ks"):
        before, after = getattr(given, name), getattr(back, name)
        assert before.dtype == after.dtype and torch.equal(before, after)
    for name in ("space", "unplaced", "warnings", "timings", "lenses", "bent"):
        assert getattr(given, name) == getattr(back, name)
    assert (
        len(back.gaussians) == 0 and prediction_of(arrays_of(prediction_of(arrays_of(given)))).Ks is not None
    )


def test_matches_come_back():
    rng = np.random.default_rng(0)
    given = KeyPoints(
        (rng.random((3, 2)), np.zeros((0, 2)), rng.random((4, 2))),
        {(0, 1): np.zeros((0, 2), int), (0, 2): np.array([[0, 3], [2, 1]])},
    )
    back = KeyPoints.of(given.arrays())
    assert all(np.array_equal(a, b) for a, b in zip(given.positions, back.positions, strict=True))
    assert list(back.pairs) == list(given.pairs)
    assert all(np.array_equal(given.pairs[edge], back.pairs[edge]) for edge in given.pairs)
    nothing = KeyPoints.of(KeyPoints((np.zeros((0, 2)),), {}).arrays())
    assert len(nothing.positions) == 1 and nothing.pairs == {}


def test_a_reconstruction_that_was_ended_goes_on_to_the_same_bits(tmp_path: Path, monkeypatch):
    """Ended twice: while photos are registered, and once the network is done."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    whole = lf.reconstruct(PHOTOS, size=84)
    stop = {"at": "refinement: photo 2 of 2"}
    told: list[str] = []

    def progress(stage: str, fraction: float) -> None:
        told.append(stage)

    def cancelled() -> bool:
        return bool(told) and told[-1] == stop["at"]

    def again():
        told.clear()
        return lf.reconstruct(PHOTOS, size=84, keep=tmp_path, progress=progress, cancelled=cancelled)

    with pytest.raises(Cancelled):
        again()
    kept = {path.name.rsplit("-", 1)[0] for path in tmp_path.iterdir()}
    assert "matches" in kept and "depth-0" in kept and "prediction" not in kept
    stop["at"] = "light"
    with pytest.raises(Cancelled):
        again()
    assert any(path.name.startswith("prediction-") for path in tmp_path.iterdir())
    stop["at"] = "never"
    monkeypatch.setattr(GuidedDepthNet, "predict", lambda *_, **__: pytest.fail("the network worked again"))
    scene = again()
    torch.set_num_threads(before)
    for name, values in vars(whole.gaussians).items():
        assert torch.equal(values, getattr(scene.gaussians, name)), name
    assert torch.equal(whole.semantics.weight_values, scene.semantics.weight_values)
    assert torch.equal(whole.viewmats, scene.viewmats)


def test_what_is_kept_hangs_on_photos_and_settings(tmp_path: Path):
    views = load_views(PHOTOS, pictures=lambda: read_pictures(PHOTOS, area=84 * 84))
    keys = {keep_of(tmp_path, views, settings).key for settings in (("mini", 1), ("mini", 2))}

    keys.add(keep_of(tmp_path, replace(views, images=views.images + 1 / 255), ("mini", 1)).key)
    keys.add(keep_of(tmp_path, replace(views, Ks=views.Ks * 1.01), ("mini", 1)).key)
    assert len(keys) == 4


def test_photos_that_are_to_be_straightened_come_back():
    given = Prediction.of_bent((None, FoundFocal(1.1, 0.01, 5, -0.05, 0.002)), "minilm", {"poses": 1.0})
    back = prediction_of(arrays_of(given))
    assert back.bent == given.bent and back.timings == given.timings and len(back.depths) == 0
