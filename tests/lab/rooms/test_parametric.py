"""Furniture by recipes: the same at every call, sound, of sizes that people use, for training only."""

import zipfile
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from langflash_core.lab.rooms import (
    HELD_OUT_LIBRARIES,
    TRAIN_LIBRARIES,
    VALIDATION_LIBRARIES,
    build_pack,
    load_pack,
    parametric,
)
from langflash_core.lab.rooms import pack as pack_module
from langflash_core.lab.rooms.catalogue import PARAMETRIC, UNSEEN, Item
from langflash_core.lab.rooms.design import Draw, Look
from langflash_core.lab.rooms.mesh import HEIGHT_CELLS, height_map, pose
from langflash_core.lab.rooms.objfile import Soup
from langflash_core.lab.rooms.pack import MAX_SOURCE_FACES
from langflash_core.lab.rooms.parametric import PIECES, _finished, parametric_models, wood_textures
from langflash_core.lab.rooms.plan import ODDS, ON_TOP, ROOM_PLANS, role
from langflash_core.lab.rooms.recipes import drawn

Model = tuple[Item, Soup, list[Look]]

FEW = 0.2  # of the copies: two or more of each recipe, made in about a second
# Tops of seats and tables above the floor, m: the recipes' ranges, widened by a cushion's thickness and by
# the half radius that a round leg goes below the floor (2.4 cm), all within furniture standards.
SEAT_HEIGHTS = {
    "plain_chair": (0.40, 0.55),
    "office_chair": (0.45, 0.60),
    "plain_armchair": (0.36, 0.50),
    "plain_sofa": (0.36, 0.50),
    "bench": (0.42, 0.58),
}
TABLE_HEIGHTS = {
    "plain_table": (0.70, 0.80),
    "coffee_table": (0.32, 0.50),
    "plain_desk": (0.64, 0.80),  # the lowest stand on two blocks of drawers
    "bedside_table": (0.38, 0.68),
}


@pytest.fixture(scope="module")
def models() -> list[Model]:
    return parametric_models(FEW)


@pytest.fixture(scope="module")
def by_recipe(models: list[Model]) -> dict[str, list[Model]]:
    found: dict[str, list[Model]] = defaultdict(list)
    for model in models:
        found[model[0].key.partition("-")[0]].append(model)
    return found


def top_before_middle(model: Model) -> float:
    """Highest point just before the middle, where one sits or where a plate stands, m."""
    item, soup, _ = model
    heights = height_map(pose(soup, item.size, item.rotation).positions, item.size)
    third, half = HEIGHT_CELLS // 3, HEIGHT_CELLS // 2
    return float(heights[half + 1 : half + 6, third:-third].max())


def test_every_recipe_makes_as_many_as_asked(by_recipe: dict[str, list[Model]]) -> None:
    assert {name: len(made) for name, made in by_recipe.items()} == {
        name: max(1, round(FEW * count)) for name, count in PIECES.items()
    }


def test_a_make_follows_from_its_recipes_name_and_number_alone(
    models: list[Model], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same at every call; recipes come and go in any order, and what others make stays."""
    whole = {item.key: (item, soup, looks) for item, soup, looks in models}
    some = dict(list(PIECES.items())[::-3])
    monkeypatch.setattr(parametric, "PIECES", some)
    fewer = parametric_models(0.0)
    assert len(fewer) == len(some)  # one of each at the least
    for item, soup, looks in fewer:
        item_before, soup_before, looks_before = whole[item.key]
        assert item == item_before and looks == looks_before
        assert soup.material_names == soup_before.material_names
        for name in ("positions", "normals", "uvs", "materials"):
            np.testing.assert_array_equal(getattr(soup, name), getattr(soup_before, name))


def test_models_are_sound(models: list[Model]) -> None:
    assert len({item.key for item, _, _ in models}) == len(models)
    for item, soup, _ in models:
        assert np.isfinite(soup.positions).all() and np.isfinite(soup.uvs).all(), item.key
        assert 0 < len(soup.positions) < MAX_SOURCE_FACES, item.key
        assert min(item.size) > 0 and max(item.size) < 4, item.key
        assert item.size == tuple(np.ptp(soup.positions.reshape(-1, 3), axis=0)), item.key
        assert not item.opening and item.creator, item.key


def test_every_triangle_has_a_look(models: list[Model]) -> None:
    woods = wood_textures()
    for item, soup, looks in models:
        assert len(looks) == len(soup.material_names) == len(set(looks)), item.key
        assert soup.materials.shape == (len(soup.positions),)
        assert set(soup.materials.tolist()) == set(range(len(looks))), item.key
        for look, _ in looks:
            assert all(0 <= v <= 1 for v in (*look.colour, look.opacity, look.gloss)), item.key
            assert not look.texture or look.texture in woods, item.key


def test_normals_are_unit(models: list[Model]) -> None:
    """Or zero: in a triangle that has collapsed to a line, as at the poles of a sphere, and at one corner
    where two fans of triangles meet, because `smooth_normals` looks at 64 corners of a point only.
    """
    for item, soup, _ in models:
        a, b, c = np.moveaxis(soup.positions, 1, 0)
        real = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-11  # m^2; smaller count as collapsed
        lengths = np.linalg.norm(soup.normals, axis=-1)
        unit = np.abs(lengths - 1) < 1e-9  # one division in doubles
        assert np.all(unit | (lengths == 0)), item.key
        assert unit[real].sum(1).min() >= 2, item.key


def test_makes_of_a_recipe_differ(by_recipe: dict[str, list[Model]]) -> None:
    for name, made in by_recipe.items():
        sizes = np.array([item.size for item, _, _ in made])
        assert len(made) > 1 and len(np.unique(sizes, axis=0)) == len(made), name
        # `_finished` alone stretches by up to 8 %: two makes within 0.1 % would be one in a thousand.
        assert (np.ptp(sizes, axis=0) / sizes.max(0)).max() > 0.001, name


def test_every_model_is_asked_for(models: list[Model]) -> None:
    asked = {word for steps in ROOM_PLANS.values() for s in steps for word in (*s.groups, *s.follow)}
    asked |= {word for words, _ in ON_TOP.values() for word in words}
    asked |= {"wall cabinet", "range hood"}  # `layout` hangs them above the counter
    asked |= set(ODDS)
    assert {role(item) for item, _, _ in models} <= asked


def plain(name: str) -> list[Model]:
    """Some makes of one recipe."""
    makes = []
    for copy in range(8):
        rng = np.random.default_rng([1, copy])
        makes.append(_finished(drawn(name, Draw(rng)), f"{name}-{copy}", PARAMETRIC, rng))
    return makes


def test_seats_are_at_the_height_of_knees(by_recipe: dict[str, list[Model]]) -> None:
    for name, (low, high) in SEAT_HEIGHTS.items():
        for model in plain(name):
            assert low <= top_before_middle(model) <= high, model[0].key
    for model in by_recipe["stool"]:
        low, high = (0.60, 0.88) if model[0].name == "bar stool" else (0.36, 0.58)
        assert low <= top_before_middle(model) <= high, model[0].key


def test_tables_are_at_the_height_of_elbows() -> None:
    for name, (low, high) in TABLE_HEIGHTS.items():
        for model in plain(name):
            assert low <= top_before_middle(model) <= high, model[0].key


@pytest.fixture
def library(tmp_path: Path) -> Path:
    """A catalogue of one triangle."""
    entry = "id#1=one\nname#1=Oak chair\ncategory#1=Living room\nmodel#1=/m/a.obj\n"
    with zipfile.ZipFile(tmp_path / "BlendSwap-CC-0.sh3f", "w") as archive:
        archive.writestr("PluginFurnitureCatalog.properties", entry + "width#1=9\ndepth#1=9\nheight#1=9\n")
        archive.writestr("m/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n")
    return tmp_path


def test_packs_by_key_leave_them_out(library: Path, tmp_path: Path) -> None:
    build_pack(library, tmp_path / "pack.npz", keys=frozenset())
    items = load_pack(tmp_path / "pack.npz").items
    assert items and PARAMETRIC not in {item.library for item in items}


def test_full_packs_hold_them(
    library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, models: list[Model]
) -> None:
    some, others = models[::10], parametric_models(0.0, UNSEEN)[::10]
    made_of = {PARAMETRIC: some, UNSEEN: others}
    monkeypatch.setattr(
        pack_module, "parametric_models", lambda copies=1.0, library=PARAMETRIC: made_of[library]
    )
    build_pack(library, tmp_path / "pack.npz")
    pack = load_pack(tmp_path / "pack.npz")
    numbers = [i for i, item in enumerate(pack.items) if item.library == PARAMETRIC]
    assert len(numbers) == len(some)
    assert set(numbers) <= set(pack.select(TRAIN_LIBRARIES))
    assert not set(numbers) & set(pack.select(HELD_OUT_LIBRARIES))
    assert not set(numbers) & set(pack.select(VALIDATION_LIBRARIES))
    unseen = {i for i, item in enumerate(pack.items) if item.library == UNSEEN}
    assert len(unseen) == len(others)
    assert unseen <= set(pack.select(VALIDATION_LIBRARIES))
    assert not unseen & {*pack.select(TRAIN_LIBRARIES), *pack.select(HELD_OUT_LIBRARIES)}
    made = {item.key: (item, looks) for item, _, looks in some}
    for i in numbers:
        item, looks = made[pack.items[i].key]
        first, count = pack.vertex_ranges[i]
        points = pack.positions[first : first + count]
        np.testing.assert_allclose(np.ptp(points, axis=0), item.size, atol=1e-4)  # 16 bits of 4 m: 6e-5
        rows = pack.material_table[pack.material_ids[first : first + count]]
        assert (rows[:, 1, 0] >= 0).any() == any(look.texture for look, _ in looks), item.key
    assert len(pack.textures) == len(wood_textures())


def test_the_two_libraries_have_no_model_in_common(models: list[Model]) -> None:
    def shapes(made: list[Model]) -> set[bytes]:
        return {soup.positions.tobytes() for _, soup, _ in made}

    others = parametric_models(FEW, UNSEEN)
    assert len(others) == len(models)
    assert {item.library for item, _, _ in others} == {UNSEEN}
    assert not shapes(others) & shapes(models)
