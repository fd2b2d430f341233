"""`lab eval ablations` and `eval report` from end to end, on toy rooms and weights that are drawn."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from app.cli import main
from app.cli.lab.evals.report import named
from langflash_core.lab.evaluation.ablations import study, tables
from langflash_core.lab.evaluation.report_small import filled
from langflash_core.lab.training.shards import write_shard
from langflash_core.network import MINI, GuidedDepthNet, save_network
from tests.lab.report_numbers import DOCUMENTS, ROOT
from tests.lab.training.conftest import toy_record


@pytest.fixture
def cache(tmp_path: Path, monkeypatch) -> Path:
    for module in (study, tables):
        monkeypatch.setattr(module, "GROUPS", (4,))
    for name, seeds in (("held_out", (0, 1)), ("train", (2,))):
        rooms = [replace(toy_record(seed), tokens=None, token_scales=None) for seed in seeds]
        write_shard(tmp_path / "cache" / name / "a.safetensors", rooms)
    torch.manual_seed(0)
    save_network(GuidedDepthNet(MINI), tmp_path / "mini.safetensors")
    return tmp_path / "cache"


@pytest.mark.slow
def test_ablations_go_on_from_what_is_kept(cache, tmp_path, capsys, monkeypatch):
    words = [
        "lab",
        "eval",
        "ablations",
        str(cache),
        "--weights",
        str(tmp_path / "mini.safetensors"),
        "--json",
    ]
    words += ["--work", str(tmp_path / "work"), "-o", str(tmp_path / "tables.md")]
    assert main([*words, "--limit", "1"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["scenes"] == 1 and first["labels"]["K4/lfa"]["groups_miou"] >= 0
    assert "bytes a Gaussian" in (tmp_path / "tables.md").read_text()
    judged = []
    real = study.judge
    monkeypatch.setattr(study, "judge", lambda *args: judged.append(args[2].seed) or real(*args))
    monkeypatch.setattr(study, "gathered", None)  # what is fitted on is there
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["scenes"] == 2 and judged == [1]


@pytest.mark.slow
def test_a_report_of_rooms_and_a_scene_has_the_tables_that_documents_ask_for(
    cache, scene_file, context, tmp_path, monkeypatch
):
    words = ["lab", "eval", "report", "-o", str(tmp_path / "report"), "--rooms", str(cache), "--limit", "1"]
    words += ["--scene", str(scene_file)]
    words += ["--weights", str(tmp_path / "mini.safetensors"), "--small", str(tmp_path / "small")]
    monkeypatch.setattr("sys.argv", ["langflash", *words])
    assert main([*words, "--backend", "torch"]) == 0
    document = json.loads((tmp_path / "small" / "report.json").read_bytes())
    assert document["command"].endswith("--weights mini.safetensors --small small")
    for name in DOCUMENTS:
        text = (ROOT / name).read_text(encoding="utf-8")
        assert "<!-- report " in text and filled(text, document) != text
    assert (tmp_path / "report" / "report.html").is_file() and list((tmp_path / "small").glob("*.svg"))


def test_nothing_to_judge_is_one_sentence(tmp_path, capsys):
    assert main(["lab", "eval", "report", "-o", str(tmp_path / "report")]) == 2
    assert "give --rooms, --pack, --posed, --photos or --scene" in capsys.readouterr().err
    assert (
        main(["lab", "eval", "report", "-o", str(tmp_path / "report"), "--scene", str(tmp_path / "no.ply")])
        == 2
    )
    assert capsys.readouterr().err.count("\n") == 1 and not any(tmp_path.iterdir())


def test_commands_are_told_without_the_folders_of_a_machine():
    words = ("/data/rooms", "--posed=/data/posed", "rooms", "--size=4x3", "a=b")
    assert [named(word) for word in words] == ["rooms", "--posed=posed", "rooms", "--size=4x3", "a=b"]
