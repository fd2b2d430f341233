"""What comes from others: no version with a known hole, hashes of what is shipped, licences named, a bill."""

import hashlib
import json
import re
import shutil
import tomllib
from contextlib import suppress
from fnmatch import fnmatch
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from app.cli import main
from langflash_core.base import shipped
from langflash_core.base.resources import asset_path
from langflash_core.errors import WeightsError
from langflash_core.network.checkpoints.stored import read_stored

ROOT = Path(__file__).resolve().parent.parent
ADVISORIES = json.loads((ROOT / "tests" / "advisories.json").read_text(encoding="utf-8"))


def requirements() -> list[Requirement]:
    """All that pyproject.toml asks for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    groups = (project["dependencies"], *project["optional-dependencies"].values())
    return [Requirement(line) for lines in groups for line in lines]


@pytest.mark.parametrize("advisory", ADVISORIES, ids=lambda one: f"{one['package']} {one['fixed']}")
def test_no_version_with_a_known_hole(advisory):
    """Installed ones, and the oldest that pyproject.toml admits."""
    package, fixed = advisory["package"], Version(advisory["fixed"])
    with suppress(PackageNotFoundError):
        assert Version(version(package)) >= fixed
    asked = [one for one in requirements() if canonicalize_name(one.name) == package]
    for requirement in asked:
        bounds = [Version(one.version) for one in requirement.specifier if one.operator in (">=", "==", "~=")]
        # torch 2.13.1 is past 2.8.0; a bound of two numbers admits none below it.
        assert bounds and max(bounds) >= fixed, f"{requirement} admits a version below {fixed}"


def test_every_requirement_has_a_lower_bound():
    for requirement in requirements():
        if canonicalize_name(requirement.name) != "langflash":
            assert any(one.operator == ">=" for one in requirement.specifier), str(requirement)


def test_hashes_are_those_of_all_shipped_weights():
    """After new weights: cd assets/weights && sha256sum *.safetensors *.json > SHA256SUMS."""
    folder = asset_path("weights")
    names = {path.name for path in folder.iterdir() if path.suffix in (".safetensors", ".json")}
    assert set(shipped._sums()) == names
    for name, digest in shipped._sums().items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest


def test_weights_that_are_not_those_shipped_are_a_sentence(tmp_path, monkeypatch):
    folder = tmp_path / "weights"
    folder.mkdir()
    name = "minilm_l6_v2_tokenizer.json"
    shutil.copy(asset_path(f"weights/{name}"), folder)
    monkeypatch.setattr(shipped, "asset_path", lambda name: tmp_path / name)
    shipped.check_shipped(folder / name)
    content = bytearray((folder / name).read_bytes())
    content[1000] ^= 1
    (folder / name).write_bytes(content)
    with pytest.raises(WeightsError, match=r"not the file that was shipped.*; reinstall") as raised:
        shipped.check_shipped(folder / name)
    assert raised.value.exit_code == 2 and "\n" not in str(raised.value)
    (folder / "mini.safetensors").write_bytes(b"other")
    with pytest.raises(WeightsError, match="not the file that was shipped"):
        read_stored(folder / "mini.safetensors")
    shutil.copy(folder / name, tmp_path / name)
    shipped.check_shipped(tmp_path / name)  # one's own file of that name, elsewhere


def test_notice_names_all_that_is_shipped_of_others():
    """Every file of assets/ that others made, or a pattern that it fits, and the text of its licence."""
    notice = " ".join((ROOT / "NOTICE").read_text(encoding="utf-8").split())
    words = [word.rpartition("/")[2] for word in re.findall(r"[\w*/.-]+\.\w+", notice)]
    own = {
        "SOURCES.md",
        "SHA256SUMS",
        "mini_card.md",
        "mini_history.md",
        "mini_orbit.jpg",
        "mini_sheet.jpg",
    }
    for folder in ("weights", "photos"):
        for path in (ROOT / "assets" / folder).iterdir():
            named = any(fnmatch(path.name, word) for word in words)
            assert named or path.name in own, f"NOTICE does not name {path.name}"
    licences = {path.name for path in (ROOT / "assets" / "licences").iterdir()}
    assert licences == {word for word in words if word in licences or word.endswith("_LICENSE.txt")}


def test_the_bill_names_everything_installed(capsys):
    assert main(["info", "--sbom"]) == 0
    bill = json.loads(capsys.readouterr().out)
    assert bill["bomFormat"] == "CycloneDX"
    versions = {one["name"]: one["version"] for one in bill["components"]}
    refs = {one["bom-ref"] for one in bill["components"]}
    for name in ("pillow", "numpy", "torch", "pillow-heif"):
        assert versions[name] == version(name)
    assert all(set(one["dependsOn"]) <= refs and one["ref"] in refs for one in bill["dependencies"])
    (torch,) = [one for one in bill["dependencies"] if one["ref"].startswith("pkg:pypi/torch@")]
    assert any(need.startswith("pkg:pypi/sympy@") for need in torch["dependsOn"])


def test_tests_cannot_reach_the_network():
    import socket

    with pytest.raises(RuntimeError, match="reach"):
        socket.create_connection(("192.0.2.1", 80), timeout=1)
    with pytest.raises(RuntimeError, match="reach"):
        socket.getaddrinfo("example.org", 443)
    with socket.create_server(("127.0.0.1", 0)) as server:
        socket.create_connection(server.getsockname(), timeout=5).close()
