"""Pages of scenes of layers: what is stored, which layers, and that other pages hold nothing of it."""

import base64
import re
import zlib
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch

from app.gl.layered import MOVING
from langflash_core import pipeline
from langflash_core.export.html import write_html
from langflash_core.export.settings import COLUMNS
from langflash_core.geometry.cameras import transform
from langflash_core.geometry.nearness import FLOOR, NEAREST, Nearness
from langflash_core.splat import compose
from langflash_core.types import Scene
from tests.app.gl.test_gl_layers import layered
from tests.export.pages import ReadPage, read_page
from tests.export.test_html import PAGE, phrases_of
from tests.geometry.twins import seen_at


def ids_of(scene: Scene) -> torch.Tensor:
    assert scene.view_ids is not None
    return scene.view_ids


def by_layers(scene: Scene) -> Scene:
    """As pages hold it: layer by layer, the others last."""
    ids = ids_of(scene)
    order = [
        *(torch.nonzero(ids == view)[:, 0] for view in range(scene.num_views)),
        torch.nonzero(ids < 0)[:, 0],
    ]
    return scene.rows(torch.cat(order))


def written(scene: Scene, folder: Path) -> ReadPage:
    write_html(scene, folder / "a.html", phrases=phrases_of(scene, ("one", "two")))
    return read_page(folder / "a.html")


def shuffled(scene: Scene) -> Scene:
    return scene.rows(torch.randperm(len(scene.gaussians), generator=torch.Generator().manual_seed(1)))


def test_layers_come_back_within_the_steps_of_their_photos(tmp_path):
    scene = shuffled(layered(3))
    page, ours = written(scene, tmp_path), by_layers(scene)
    ids = ids_of(ours)
    assert [layer["view"] for layer in page.header["layers"]] == [0, 1, 2]
    assert [layer["count"] for layer in page.header["layers"]] == [int((ids == v).sum()) for v in range(3)]
    assert all("lowest" in layer for layer in page.header["layers"])
    found = page.gaussians()
    for view in range(3):
        own = ids == view
        places = [
            torch.cat((seen_at(pos_c, scene.Ks[view].double()), pos_c[:, 2:]), 1).T
            for g in (found, ours.gaussians)
            for pos_c in [transform(scene.viewmats[view].double(), g.means[own].double())]
        ]
        apart = torch.stack(
            [(places[0][:2] - places[1][:2]).abs().amax(), (places[0][2] / places[1][2]).log().abs().amax()]
        )
        # half a step each; and float32 of what the page gives, 1e-6 of the place, 40 pixels a unit and more
        assert (
            float(apart[0]) <= 0.5 / COLUMNS.place_steps[0] + 1e-3
            and float(apart[1]) <= 0.5 / COLUMNS.place_steps[2] + 1e-5
        )
    unowned = ids < 0
    assert int(unowned.sum()) == 40
    assert torch.allclose(found.means[unowned], ours.gaussians.means[unowned], atol=2e-4)
    colours = (found.sh[:, 0] - ours.gaussians.sh[:, 0]).abs()
    assert float(colours.max()) < float(ours.gaussians.sh[:, 0].std()) / 10  # a book of 256
    assert np.abs(page.dense_weights() - dense(ours)).max() <= 2 / 255


def dense(scene: Scene) -> np.ndarray:
    return scene.semantics.dense_weights().numpy()


def test_what_its_photo_does_not_see_is_stored_as_ever(tmp_path):
    """A layer of which a part was moved behind its photo."""
    scene = layered(3)
    means = scene.gaussians.means.clone()
    means[torch.nonzero(ids_of(scene) == 1)[0, 0], 2] = -4.0
    scene = replace(scene, gaussians=replace(scene.gaussians, means=means))
    page = written(scene, tmp_path)
    assert ["lowest" in layer for layer in page.header["layers"]] == [True, False, True]
    assert torch.allclose(page.gaussians().means, by_layers(scene).gaussians.means, atol=5e-3)


def test_places_on_a_photos_grid_take_half_the_bytes(tmp_path):
    """As they are made: of pixels of a photo, at depths that change slowly."""
    scene = layered(3, count=6000, unowned=0)
    for view in range(3):
        own = torch.nonzero(ids_of(scene) == view)[:, 0]
        rows = torch.arange(len(own))
        slopes = torch.stack(((rows % 100) / 100 - 0.5, (rows // 100) / 100 - 0.3, torch.ones(len(rows))), 1)
        seen = slopes * (2 + 0.2 * torch.sin(9 * slopes[:, :1]))
        back = torch.linalg.inv(scene.viewmats[view])
        scene.gaussians.means[own] = seen @ back[:3, :3].T + back[:3, 3]
    sizes = []
    for shown in (scene, scene.with_record(layered=False)):
        write_html(shown, tmp_path / "a.html")
        columns = read_page(tmp_path / "a.html").header["columns"]
        payload = unpacked(tmp_path / "a.html")
        sizes.append(sum(packed_size(payload, columns, name) for name in ("mean", "place")))
    assert sizes[0] < sizes[1] / 2


def unpacked(path: Path) -> bytes:
    found = re.search('id="payload">([^<]*)<', path.read_text(encoding="utf-8"))
    assert found is not None
    return zlib.decompress(base64.b64decode(found[1]))


def packed_size(payload: bytes, columns: list, name: str) -> int:
    """Bytes that the columns of a name take, deflated."""
    start, own = 0, b""
    for column, count, width, _ in columns:
        if column.startswith(name):
            own += payload[start : start + count * width]
        start += count * width
    return len(zlib.compress(own, 9))


def test_a_page_without_layers_holds_nothing_of_them(tmp_path):
    """One layer alone, and layers of which nobody knows any more, are pages as of any scene."""
    one, plain = layered(1), layered(3).with_record(layered=False)
    for name, scene in (("one", one), ("plain", plain)):
        write_html(pipeline.page_layers(scene), tmp_path / f"{name}.html", title="a")
        write_html(scene.with_record(layered=False), tmp_path / "other.html", title="a")
        text = (tmp_path / f"{name}.html").read_text(encoding="utf-8")
        assert text == (tmp_path / "other.html").read_text(encoding="utf-8")
        assert "blend.frag" not in text and "LayeredWorld" not in text
    write_html(pipeline.page_layers(layered(3)), tmp_path / "layers.html")
    text = (tmp_path / "layers.html").read_text(encoding="utf-8")
    assert "blend.frag" in text and "LayeredWorld" in text


def test_a_page_holds_the_layers_that_lie_all_over_the_walk(tmp_path):
    scene = layered(12, count=60)
    shown = pipeline.page_layers(scene)
    kept = ids_of(shown).unique().tolist()
    assert len(kept) == pipeline.PAGE_LAYERS + 1 and kept[:2] == [-1, 0] and kept[-1] == 11
    assert (
        max(b - a for a, b in pairwise(kept[1:])) <= 3
    )  # of a row: each left out is beside one that is kept
    assert int((ids_of(shown) < 0).sum()) == int((ids_of(scene) < 0).sum())
    write_html(shown, tmp_path / "a.html")
    assert [layer["view"] for layer in read_page(tmp_path / "a.html").header["layers"]] == kept[1:]
    assert len(pipeline.page_layers(shown).gaussians) == len(shown.gaussians)


def test_the_page_blends_by_our_numbers():
    text = "".join((PAGE / f"{name}.js").read_text(encoding="utf-8") for name in ("layers", "blending"))
    said = {name: float(value) for name, value in re.findall(r"const (\w+) = ([\d.e-]+);", text)}
    ours = {
        "NEAREST": NEAREST,
        "FLOOR": FLOOR,
        "DEPTH": compose.DEPTH,
        "CLOSES": compose.CLOSES,
        "MOVING": MOVING,
    }
    assert {name: said[name] for name in ours} == ours
    assert f"PLACE_STEPS = {list(COLUMNS.place_steps)};" in text


def test_layers_that_nobody_owns_are_one_surface(tmp_path):
    scene = layered(3)
    unowned = replace(scene, view_ids=torch.full_like(ids_of(scene), -1))
    write_html(unowned, tmp_path / "a.html")
    assert "layers" not in read_page(tmp_path / "a.html").header
    assert not pipeline.page_layers(unowned).layered


@pytest.mark.parametrize("most", [1, 2, 5, 99])
def test_layers_spread_from_the_first(most):
    near = Nearness.of(layered(6))
    kept = near.spread(most)
    assert len(kept) == min(most, 6) and kept[0] == 0 and list(kept) == sorted(set(kept))
    assert most != 2 or kept == (0, 5)
