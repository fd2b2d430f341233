"""The scene file: what is saved comes back, and what is not whole is refused in one sentence."""

import json
import os
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy
import safetensors.torch
import torch

from langflash_core.base import memory
from langflash_core.errors import OutputError, SceneFileError
from langflash_core.export import export, read
from langflash_core.scene import container
from langflash_core.scene.fields import REQUIRED, to_fields
from langflash_core.scene.file import _digest, load, save
from langflash_core.scene.report import describe, describe_file
from langflash_core.splat.reference import render
from langflash_core.surface.assemble import assemble
from langflash_core.surface.prune import prune
from langflash_core.types import Cost, Record, Scene
from tests.scene.plane import wall_prediction

LIGHT = {"gains": [[1.25, 1.0, 0.9], [0.8, 1.0, 1.1]], "offsets": [[0.01, 0.0, 0.0], [-0.01, 0.0, 0.0]]}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return prune(assemble(*wall_prediction(width=42, height=28))).with_record(
        metric_scale=2.5, others={"note": "grüße"}
    )


@pytest.fixture
def path(scene, tmp_path):
    save(scene, tmp_path / "a.langflash")
    return tmp_path / "a.langflash"


def test_what_does_not_fit_into_memory_is_refused_before_it_is_read(path, scene, monkeypatch):
    opened = describe_file(path)["opened_bytes"]
    for free, fits in ((2 * opened, True), (2 * opened - 1, False)):
        monkeypatch.setattr(memory, "free_memory", lambda free=free: free)
        if fits:
            load(path)
            continue
        said = f"holds {len(scene.gaussians):,} Gaussians: .* to open, .* are free; close other programs, or "
        with pytest.raises(SceneFileError, match=said):
            load(path)
    container.check_container(path)  # the header alone fits


def test_a_scene_takes_in_memory_what_the_report_says(path):
    opened = load(path)
    held = [*vars(opened.gaussians).values(), *vars(opened.semantics).values(), *vars(opened).values()]
    tensors = sum(value.nbytes for value in held if isinstance(value, torch.Tensor))
    assert describe_file(path)["opened_bytes"] == tensors + sum(map(len, opened.photos))


def test_a_check_reads_the_header_alone(path, monkeypatch):
    assert container._read_file(path, whole=False) == (container._read_file(path)[0], {})
    monkeypatch.setattr(container, "_read_arrays", None)
    container.check_container(path)


def test_tensors_are_read_as_safetensors_reads_them_which_holds_up_every_frame(path, monkeypatch):
    """It copies all of them under Python's lock: of 580 MB a window stood still for 1.4 s."""
    wanted = safetensors.numpy.load(path.read_bytes())
    monkeypatch.setattr(safetensors.numpy, "load", None)
    arrays = container.read_container(path).arrays
    assert arrays.keys() == wanted.keys()
    for name, values in arrays.items():
        assert values.dtype == wanted[name].dtype and np.array_equal(values, wanted[name]), name
        assert values.flags.owndata and values.flags.writeable


def test_a_scene_that_is_saved_over_while_it_is_read_is_read_as_it_was(scene, path, monkeypatch):
    """By another program; the sizes of two files are not to be compared."""
    parsed, known = container._parse_header, path.read_bytes()

    def save_another(*given):
        save(scene.with_record(others={"note": "longer " * 99}), path)
        return parsed(*given)

    monkeypatch.setattr(container, "_parse_header", save_another)
    assert load(path).record.others == {"note": "grüße"}
    assert path.read_bytes() != known and load(path).record.others["note"].startswith("longer")


def tensors_of(scene: Scene) -> dict[str, torch.Tensor]:
    gaussians, semantics = scene.gaussians, scene.semantics
    return {
        **{name: getattr(gaussians, name) for name in ("means", "quats", "scales", "opacities", "sh")},
        "weights": semantics.dense_weights(),
        "dictionary": semantics.dictionary,
        "viewmats": scene.viewmats,
        "Ks": scene.Ks,
    }


def views_of(scene: Scene) -> list[int]:
    assert scene.view_ids is not None
    return scene.view_ids.tolist()


def same(first: Scene, second: Scene) -> bool:
    pairs = zip(tensors_of(first).values(), tensors_of(second).values(), strict=True)
    return (
        all(torch.equal(a, b) for a, b in pairs)
        and first.photos == second.photos
        and first.view_size == second.view_size
        and first.record == second.record
        and views_of(first) == views_of(second)
        and first.semantics.space == second.semantics.space
    )


def test_what_is_saved_comes_back(scene, path):
    read = load(path)
    assert read.photos == scene.photos and read.view_size == scene.view_size
    assert read.record == replace(scene.record, cost=Cost())
    assert views_of(read) == views_of(scene)
    assert read.semantics.space == "minilm"
    exact = ("means", "dictionary", "viewmats", "Ks")
    for name, values in tensors_of(scene).items():
        found = tensors_of(read)[name]
        assert found.dtype == torch.float32 and found.shape == values.shape
        if name in exact:
            assert torch.equal(found, values)
        else:
            # float16 keeps 11 bits; below its normal range (6.1e-5) an absolute 3e-8.
            assert torch.allclose(found, values, rtol=2**-10, atol=3e-8), name
    for _ in range(5):
        save(load(path), path)
    for name, values in tensors_of(scene).items():
        # Rows are renormalised on every load, which may move a weight by one step of 2^-11 each.
        assert torch.allclose(tensors_of(load(path))[name], values, rtol=2**-8, atol=3e-8), name


def test_half_precision_does_not_show(scene, path):
    """The figures that fields.py states."""
    read = load(path)
    for view in (0, 1):
        before, after = (render(s, s.camera(view)) for s in (scene, read))
        error = (before.rgb - after.rgb).square().mean().sqrt()
        assert float(error) < 10 ** (-75 / 20)
        assert before.weight_maps is not None and after.weight_maps is not None
        gaps = (before.weight_maps - after.weight_maps).abs()
        # One splat that rounding moves across the 1/255 cut changes a pixel by that much at most.
        assert float(gaps.mean()) < 0.0001 and float(gaps.max()) < 1 / 255


def test_a_scene_without_atoms_photos_or_gaussians(tmp_path, scene):
    prediction, views = wall_prediction(width=14, height=14)
    bare = replace(prediction, weights=prediction.weights[:, :0], dictionary=prediction.dictionary[:0])
    plain = replace(assemble(bare, views), photos=(), view_ids=None, record=Record())
    empty = prune(replace(scene, gaussians=replace(scene.gaussians, opacities=scene.gaussians.opacities * 0)))
    for case in (plain, empty):
        save(case, tmp_path / "b.langflash")
        read = load(tmp_path / "b.langflash")
        assert len(read.gaussians) == len(case.gaussians) and read.semantics.num_atoms == 0
        assert (read.view_ids is None) == (case.view_ids is None)
        describe(read)


def test_many_atoms_need_wider_ids(tmp_path, scene):
    generator = torch.Generator().manual_seed(0)
    for num_atoms in (1, 256, 257, 40_000):
        dictionary = torch.nn.functional.normalize(torch.randn(num_atoms, 4, generator=generator), dim=-1)
        ids = torch.randint(0, num_atoms, scene.semantics.weight_ids.shape, generator=generator)
        ids[0, 0] = num_atoms - 1
        wide = replace(scene, semantics=replace(scene.semantics, weight_ids=ids, dictionary=dictionary))
        save(wide, tmp_path / "c.langflash")
        assert torch.equal(load(tmp_path / "c.langflash").semantics.weight_ids, ids)


def test_a_save_that_fails_leaves_nothing_and_keeps_the_old_file(tmp_path, scene, path, monkeypatch):
    whole = path.read_bytes()
    monkeypatch.setattr(
        os, "replace", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device"))
    )
    with pytest.raises(OutputError, match="No space left"):
        save(scene, path)
    monkeypatch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        save(scene, path)
    assert path.read_bytes() == whole
    assert os.listdir(tmp_path) == ["a.langflash"]


def test_a_scene_that_is_not_whole_is_not_saved(tmp_path, scene):
    def gaussians(**changes):
        return replace(scene, gaussians=replace(scene.gaussians, **changes))

    def semantics(**changes):
        return replace(scene, semantics=replace(scene.semantics, **changes))

    cases = {
        "scales": gaussians(scales=scene.gaussians.scales * 0),
        "opacities": gaussians(opacities=scene.gaussians.opacities + 1),
        "quats": gaussians(quats=scene.gaussians.quats * 2),
        "sh": gaussians(sh=scene.gaussians.sh * torch.nan),
        "weight_values": semantics(weight_values=scene.semantics.weight_values * 0.5),
        "dictionary": semantics(dictionary=scene.semantics.dictionary * 3),
        "Ks": replace(scene, Ks=-scene.Ks),
        "viewmats": replace(scene, viewmats=scene.viewmats * 2),
        "JSON": scene.with_record(others={"bad": float("nan")}),
    }
    for name, case in cases.items():
        with pytest.raises(ValueError, match=name):
            save(case, tmp_path / "bad.langflash")
    assert not os.listdir(tmp_path)


def refused(path) -> str:
    with pytest.raises(SceneFileError) as caught:
        load(path)
    message = str(caught.value)
    assert path.name in message and ";" in message and "\n" not in message
    assert caught.value.exit_code == 2
    return message


def test_missing_folders_and_foreign_files(tmp_path):
    assert "does not exist" in refused(tmp_path / "nowhere.langflash")
    assert "is a folder" in refused(tmp_path)
    foreign = tmp_path / "foreign.langflash"
    for content, words in (
        (b"", "empty file"),
        (b"x", "expected a langflash-scene file, found something else"),
        (b"\xff\xd8\xff\xe0 and so on " * 20, "found a JPEG photo"),
        (b"ply\nformat binary_little_endian 1.0\n", "found a PLY file"),
        (safetensors.torch.save({"weight": torch.zeros(3)}), "found another safetensors file"),
        (
            safetensors.torch.save({"weight": torch.zeros(3)}, {"format": "pt"}),
            "found another safetensors file",
        ),
        (struct.pack("<Q", 2**63) + b"{}" * 50, "found something else"),
        (struct.pack("<Q", 40_000) + b"[" * 40_000, "found something else"),
    ):
        foreign.write_bytes(content)
        assert words in refused(foreign)


def header_of(path: Path) -> dict[str, str]:
    with safetensors.safe_open(path, "pt") as file:
        return file.metadata()


def rewrite(path: Path, fields: dict[str, torch.Tensor], described: dict | None = None) -> None:
    """These tensors under a right checksum, as another program would write them."""
    strings = header_of(path)
    text = strings["scene"] if described is None else json.dumps(described)
    strings |= {"scene": text, "digest": _digest(text, fields)}
    path.write_bytes(safetensors.torch.save(fields, strings))


def _resaved(path, **changes) -> None:
    """The same tensors under another header."""
    path.write_bytes(
        safetensors.torch.save(safetensors.torch.load(path.read_bytes()), {**header_of(path), **changes})
    )


def test_newer_and_nonsense_versions(path):
    _resaved(path, version="4")
    assert "format 4, this program reads format 3" in refused(path)
    _resaved(path, version="one")
    assert "version reads 'one'" in refused(path)


def test_a_cut_file_says_how_much_is_there(path):
    whole = path.read_bytes()
    length = struct.unpack("<Q", whole[:8])[0]
    path.write_bytes(whole[:-10])
    assert f"expected {len(whole)} bytes, found {len(whole) - 10}" in refused(path)
    path.write_bytes(whole + b"more")
    assert f"expected {len(whole)} bytes, found {len(whole) + 4}" in refused(path)
    path.write_bytes(whole[: 8 + length // 2])
    refused(path)
    for cut in (1, 7, 8, 9, 100, 8 + length - 1, 8 + length, 8 + length + 1):
        path.write_bytes(whole[:cut])
        refused(path)


def test_a_file_with_a_field_missing_or_of_a_wrong_type_is_refused_even_with_a_right_checksum(path, scene):
    fields = safetensors.torch.load(path.read_bytes())

    def refusal(changed: dict) -> str:
        rewrite(path, changed)
        return refused(path)

    for name in REQUIRED:
        refusal({key: value for key, value in fields.items() if key != name})
        refusal({**fields, name: fields[name].to(torch.float64)})
        refusal({**fields, name: fields[name][:-1].clone()})
    for name, values in (
        ("scales", -fields["scales"]),
        ("means", fields["means"] * torch.nan),
        ("weight_ids", fields["weight_ids"] + 100),
        ("stranger", torch.zeros(2)),
        ("view_ids", fields["view_ids"] + 100),
        ("view_ids", fields["view_ids"].float()),
        ("view_ids", fields["view_ids"][:-1].clone()),
    ):
        assert name in refusal({**fields, name: values})


def detailed(scene: Scene) -> Scene:
    """With levels and confidences."""
    count = len(scene.gaussians)
    levels = (torch.arange(count) % 5 > 0).to(torch.uint8)
    return replace(scene, levels=levels, confidences=torch.linspace(0, 1, count))


def test_levels_and_confidences_come_back_in_a_file_of_version_3(path, tmp_path, scene):
    """Who reads version 2 alone is told so; without them a file is what it always was."""
    assert header_of(path)["version"] == "2" and load(path).levels is None and load(path).confidences is None
    whole = detailed(scene)
    assert whole.levels is not None and whole.confidences is not None
    for names in (("levels",), ("confidences",), ("levels", "confidences")):
        known = replace(scene, **{name: getattr(whole, name) for name in names})
        save(known, tmp_path / "b.langflash")
        read = load(tmp_path / "b.langflash")
        assert header_of(tmp_path / "b.langflash")["version"] == "3" and same(read, load(path))
        assert (read.levels is None, read.confidences is None) == tuple(
            name not in names for name in ("levels", "confidences")
        )
        if read.levels is not None:
            assert read.levels.dtype == torch.uint8 and torch.equal(read.levels, whole.levels)
        if read.confidences is not None:
            assert float((read.confidences - whole.confidences).abs().max()) <= 0.5 / 255 + 1e-7
        told = describe(read)["bytes"]
        assert all(told[name] == len(scene.gaussians) for name in names)
        assert told["photos"] == describe(scene)["bytes"]["photos"]
        save(read, tmp_path / "c.langflash")  # bytes are what they were: 255 (n / 255) rounds to n
        first, second = (
            safetensors.torch.load((tmp_path / f"{letter}.langflash").read_bytes()) for letter in "bc"
        )
        assert all(torch.equal(first[name], second[name]) for name in names)
        save(known, tmp_path / "d.langflash")
        assert (tmp_path / "d.langflash").read_bytes() == (tmp_path / "b.langflash").read_bytes()


@pytest.mark.parametrize(
    ("name", "wrong", "words"),
    [
        ("levels", lambda values: values + 2, "levels: expected values in [0, 2)"),
        ("levels", lambda values: values.long(), "levels: expected torch.uint8"),
        ("levels", lambda values: values[1:].clone(), "levels: expected shape"),
        ("confidences", lambda values: values.float(), "confidences: expected torch.uint8"),
        ("confidences", lambda values: values[None].clone(), "confidences: expected shape"),
    ],
)
def test_levels_and_confidences_that_make_no_sense_are_refused(path, scene, name, wrong, words, unchecked):
    save(detailed(scene), path)
    fields = safetensors.torch.load(path.read_bytes())
    rewrite(path, {**fields, name: wrong(fields[name])})
    assert words in refused(path)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("warnings", "dark", "warnings: expected list, received 'dark'"),
        ("photos", [1], "photos: expected a list of str"),
        ("preset", 3, "preset: expected str, received 3"),
        ("metric_scale", True, "metric_scale: expected int or float"),
        ("atom_names", {"two": "chair"}, "atom_names: expected numbers of atoms, received 'two'"),
        ("silent_atoms", [99], "silent_atoms: expected values in [0, 6), received 99 to 99"),
        ("calibration", [1], "calibration: expected dict"),
        ("edits", {"deleted": "all"}, "deleted: expected int, received 'all'"),
        ("light", [1], "light: expected dict"),
        ("light", {"gains": LIGHT["gains"]}, "light: expected gains and offsets, received gains"),
        ("light", LIGHT | {"gains": 3 * [[1, 1, 1]]}, "light: expected gains in 2 rows of 3 finite numbers"),
        ("light", LIGHT | {"offsets": [[0, 0, 0], [0, 0]]}, "light: expected offsets in 2 rows"),
        ("light", LIGHT | {"offsets": [[0, 0, 0], [0, 0, "0"]]}, "light: expected offsets in 2 rows"),
        ("light", LIGHT | {"offsets": [[0, 0, 0], [0, 0, torch.nan]]}, "light: expected offsets in 2 rows"),
        ("light", LIGHT | {"gains": [[1, 1, 1], [1, 0, 1]]}, "light: expected gains above 0"),
    ],
)
def test_a_record_that_makes_no_sense_is_refused(path, key, value, words):
    described = json.loads(header_of(path)["scene"])
    described["metadata"][key] = value
    rewrite(path, safetensors.torch.load(path.read_bytes()), described)
    assert words in refused(path)
    if key == "light":
        with pytest.raises(SceneFileError) as told:  # without torch
            describe_file(path)
        assert words in str(told.value)


def test_more_than_a_thousand_photos_come_back_in_order(scene, tmp_path):
    """Their names have three digits, or more."""
    photos = tuple(scene.photos[0] + bytes([view % 251, view // 251]) for view in range(1003))
    viewmats, Ks = scene.viewmats[:1].repeat(1003, 1, 1), scene.Ks[:1].repeat(1003, 1, 1)
    many = replace(scene, photos=photos, viewmats=viewmats, Ks=Ks, record=Record())
    save(many, tmp_path / "a.langflash")
    assert load(tmp_path / "a.langflash").photos == photos
    export(many, tmp_path / "a.ply")
    assert read(tmp_path / "a.ply").photos == photos


def test_the_light_of_its_photos_comes_back(scene, tmp_path):
    lit = scene.with_record(light=LIGHT)
    save(lit, tmp_path / "a.langflash")
    assert load(tmp_path / "a.langflash").record.light == LIGHT
    assert describe_file(tmp_path / "a.langflash")["light"] == describe(lit)["light"] == LIGHT
    save(scene, tmp_path / "a.langflash")
    assert b"light" not in (tmp_path / "a.langflash").read_bytes()
    assert load(tmp_path / "a.langflash").record.light == {} and describe(scene)["light"] is None
    for views in (1, 3):
        wrong = {name: (2 * rows)[:views] for name, rows in LIGHT.items()}
        with pytest.raises(ValueError, match="light: expected gains in 2 rows"):
            scene.with_record(light=wrong)


def test_equal_scenes_give_equal_bytes_whatever_the_run_cost(path, tmp_path, scene):
    """safetensors itself writes the header's strings in any order: of 20 files two would differ."""
    whole = path.read_bytes()
    for run in range(20):
        cost = Cost({"encoder": 0.1 * run}, {"total": float(run)}, 100 + run)
        save(scene.with_record(cost=cost), tmp_path / "b.langflash")
        assert (tmp_path / "b.langflash").read_bytes() == whole
    save(load(path), tmp_path / "c.langflash")
    again = (tmp_path / "c.langflash").read_bytes()
    assert safetensors.torch.load(again).keys() == safetensors.torch.load(whole).keys()
    # The library's own reader sees the same strings and the body at an aligned place.
    length = struct.unpack("<Q", whole[:8])[0]
    assert length % 8 == 0
    assert set(header_of(path)) == {"format", "version", "scene", "digest"}


KEPT = Path(__file__).parents[1] / "fixtures" / "scenes"
VERSION_1, VERSION_2, VERSION_3 = (KEPT / f"version_{number}.langflash" for number in (1, 2, 3))


def test_a_file_of_version_1_opens_with_all_it_says(tmp_path):
    """Written by the program of format 1 from `wall_prediction(width=8, height=6)`, pruned."""
    old = load(VERSION_1)
    truth = prune(assemble(*wall_prediction(width=8, height=6)))
    assert views_of(old) == [0] * 48 + [1] * 6
    for name, values in tensors_of(truth).items():
        # float16 in the file; means are sums whose order may differ between machines.
        assert torch.allclose(tensors_of(old)[name], values, rtol=2**-9, atol=1e-4), name
    record = old.record
    assert (record.preset, record.photos) == ("mini", ("0.jpg", "1.jpg"))
    assert record.warnings == ("a note of triage", "a note of the network")
    assert record.counts == {"predicted": 96, "unusable": 0, "seen_through": 0}
    assert record.pruning["gaussians_after"] == 54
    assert record.network_unit == pytest.approx(3.2417, abs=1e-3) and record.metric_scale == 2.5
    assert record.calibration == {"threshold": 0.7, "negatives": ["object", "wall"]}
    assert (record.atom_names, record.silent_atoms) == ({2: "my chair"}, (3,))
    assert record.num_deleted == 4
    assert record.cost.peak_memory_mb == 321 and record.cost.timings["encoder"] == 0.25
    assert set(record.others) == {"note", "refinement"}  # which is no longer made
    assert record.others["note"] == "grüße"
    assert describe(old)["timings"]["encoder"] == 0.25
    save(old, tmp_path / "new.langflash")
    new = load(tmp_path / "new.langflash")
    assert new.record == replace(record, cost=Cost()) and views_of(new) == views_of(old)
    assert describe(new)["timings"] is None


def test_a_file_of_version_2_opens_with_all_it_says():
    """The file of version 1, read and saved by the first program of format 2."""
    old, new = load(VERSION_1), load(VERSION_2)
    assert new.record == replace(old.record, cost=Cost()) and views_of(new) == views_of(old)
    assert new.photos == old.photos and new.view_size == old.view_size
    for name, values in tensors_of(old).items():
        # Rows are renormalised on every load, which may move a weight by one step of 2^-11.
        assert torch.allclose(tensors_of(new)[name], values, rtol=2**-9, atol=3e-8), name


def test_a_file_of_version_3_opens_with_all_it_says():
    """The file of version 2 with `detailed`, saved by the first program of format 3."""
    old, new = load(VERSION_2), load(VERSION_3)
    assert new.record == old.record and views_of(new) == views_of(old) and new.photos == old.photos
    for name, values in tensors_of(old).items():
        assert torch.allclose(tensors_of(new)[name], values, rtol=2**-9, atol=3e-8), name
    known = detailed(old)
    assert new.levels is not None and known.levels is not None and torch.equal(new.levels, known.levels)
    assert new.confidences is not None and known.confidences is not None
    assert torch.equal((255 * new.confidences).round(), (255 * known.confidences).round())


def test_counts_of_version_1_that_do_not_fit_say_nothing(tmp_path):
    path, content = tmp_path / "a.langflash", VERSION_1.read_bytes()
    path.write_bytes(content)
    described = json.loads(header_of(path)["scene"])
    for wrong in ([54], [50, 5], [54, 0, 0], None):
        described["metadata"]["gaussians_per_view"] = wrong
        rewrite(path, safetensors.torch.load(content), described)
        assert load(path).view_ids is None


def test_random_damage_gives_a_refusal_or_an_equal_scene(path):
    """Flips of bits and bytes, in the header more often than chance would; cuts; joined pieces."""
    whole = path.read_bytes()
    truth = load(path)
    header_end = 8 + struct.unpack("<Q", whole[:8])[0]
    rng = np.random.default_rng(11)
    refusals = 0
    for round_number in range(400):
        damaged = bytearray(whole)
        limit = (8, header_end, len(whole))[round_number % 3]
        for _ in range(int(rng.integers(1, 4))):
            place = int(rng.integers(0, limit))
            damaged[place] = (
                int(rng.integers(0, 256))
                if rng.random() < 0.5
                else damaged[place] ^ (1 << int(rng.integers(8)))
            )
        if round_number % 10 == 9:
            damaged = damaged[: int(rng.integers(0, len(whole)))]
        path.write_bytes(bytes(damaged))
        try:
            read = load(path)
        except SceneFileError as error:
            assert "\n" not in str(error)
            refusals += 1
            continue
        assert same(read, truth)
    assert refusals > 300


def test_the_report_is_plain_json_with_the_figures(scene):
    report = describe(scene)
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert report["gaussians"] == len(scene.gaussians)
    assert report["pruning"]["gaussians_before"] > report["gaussians"]
    assert report["bytes"]["means"] == 12 * report["gaussians"]
    assert report["bytes"]["total"] == sum(t.numel() * t.element_size() for t in to_fields(scene).values())
    assert report["bytes"]["photos"] == sum(len(photo) for photo in scene.photos)
    assert report["timings"]["total"] == pytest.approx(sum(scene.record.cost.timings.values()))
    assert report["warnings"] == ["a note of triage", "a note of the network"]
    box, core = report["bounding_box"], report["core_box"]
    assert all(
        a <= b < c <= d for a, b, c, d in zip(box["min"], core["min"], core["max"], box["max"], strict=True)
    )
    assert report["metric_scale"] == 2.5 and report["space"] == "minilm" and report["sh_degree"] == 0
