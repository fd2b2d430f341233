"""A wheel beside other people's packages; with the core's needs alone; and an editable install."""

import ast
import json
import os
import re
import subprocess
import sys
import venv
import zipfile
from email import message_from_bytes
from email.message import Message
from importlib.metadata import PackageNotFoundError, distribution, packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import langflash_core
from langflash_core.base.optional import EXTRAS
from langflash_core.base.resources import asset_path

ROOT = Path(__file__).resolve().parent.parent
OTHERS = "others_app-1.0"
# What a package is imported as, where it may not be installed or does not tell.
IMPORTED_AS = {"scikit-image": "skimage", "openexr": "OpenEXR"}
USED_BY_OTHERS = {
    "pyopengl": "imgui-bundle's backend for glfw draws through it",
    "tensorboard": "torch.utils.tensorboard writes through it",
}
pytestmark = pytest.mark.slow


def python(*words, cwd: Path, program: Path | str = sys.executable) -> str:
    """What a Python says on stdout; nothing of this process's paths reaches it."""
    done = ran(program, *words, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def ran(program: Path | str, *words, cwd: Path) -> subprocess.CompletedProcess[str]:
    """How a program ends that nothing of this process's paths reaches."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return subprocess.run(
        [program, *map(str, words)], cwd=cwd, env=environment, capture_output=True, text=True, timeout=300
    )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    python("-m", "build", "--wheel", "--no-isolation", "-o", folder, ROOT, cwd=folder)
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def metadata(wheel) -> Message:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return message_from_bytes(archive.read(name))


@pytest.fixture(scope="module")
def others(tmp_path_factory) -> Path:
    """A wheel of somebody else, who owns the name `app`."""
    path = tmp_path_factory.mktemp("others") / f"{OTHERS}-py3-none-any.whl"
    files = {
        "app/__init__.py": 'OWNER = "somebody else"\n',
        "app/cli.py": 'raise ImportError("this is not the command line of LangFlash")\n',
        f"{OTHERS}.dist-info/METADATA": "Metadata-Version: 2.1\nName: others-app\nVersion: 1.0\n",
        f"{OTHERS}.dist-info/WHEEL": "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    record = "".join(f"{name},,\n" for name in (*files, f"{OTHERS}.dist-info/RECORD"))
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in {**files, f"{OTHERS}.dist-info/RECORD": record}.items():
            archive.writestr(name, text)
    return path


class Place:
    """An environment that holds the given wheels, and what they need from the folder `needs`."""

    def __init__(self, folder: Path, wheels: list[Path], needs: Path):
        venv.create(folder, with_pip=False)
        self.scripts = folder / ("Scripts" if os.name == "nt" else "bin")
        self.interpreter = self.scripts / "python"
        words = ("--quiet", "--no-deps", "--no-index", "--disable-pip-version-check", "--no-compile")
        python("-m", "pip", "--python", folder, "install", *words, *wheels, cwd=folder)
        code = "import sysconfig; print(sysconfig.get_path('purelib'))"
        self.packages = Path(self.python("-c", code, cwd=folder).strip())
        (self.packages / "needs.pth").write_text(f"{needs}\n", encoding="utf-8")

    def python(self, *words, cwd: Path) -> str:
        return python(*words, cwd=cwd, program=self.interpreter)

    def langflash(self, *words, cwd: Path) -> str:
        return python(*words, cwd=cwd, program=self.scripts / "langflash")

    def refused(self, *words, cwd: Path) -> tuple[int, str]:
        """Exit code and sentence of a command that cannot be run."""
        done = ran(self.scripts / "langflash", *words, cwd=cwd)
        assert done.stderr.startswith("langflash: ") and done.stderr.count("\n") == 1 and not done.stdout
        return done.returncode, done.stderr


@pytest.fixture(scope="module")
def installed(wheel, others, tmp_path_factory) -> Place:
    """The wheel and somebody else's; all that this environment has can be used."""
    here = Path(str(distribution("torch").locate_file("")))
    return Place(tmp_path_factory.mktemp("whole") / "venv", [wheel, others], here)


@pytest.fixture(scope="module")
def bare(wheel, metadata, tmp_path_factory) -> Place:
    """The wheel as `pip install langflash` gives it: with the core's declared needs and nothing else."""
    needs = tmp_path_factory.mktemp("needs")
    for name in sorted(closure(core_requirements(metadata))):
        found = distribution(name)
        for top in {file.parts[0] for file in found.files or () if file.parts[0] != ".."}:
            link = needs / top
            if not link.exists():
                link.symlink_to(Path(str(found.locate_file(top))).resolve())
    return Place(tmp_path_factory.mktemp("bare") / "venv", [wheel], needs)


@pytest.fixture(scope="module")
def checkout(others, tmp_path_factory) -> Place:
    """An editable install of the checkout, and somebody else's wheel."""
    folder = tmp_path_factory.mktemp("editable")
    code = f"from hatchling.build import build_editable; build_editable({str(folder)!r})"
    python("-c", code, cwd=ROOT)
    (editable,) = folder.glob("*.whl")
    here = Path(str(distribution("torch").locate_file("")))
    return Place(folder / "venv", [editable, others], here)


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def requirements(metadata: Message) -> list[tuple[Requirement, str]]:
    """What the wheel needs, each with the extra that asks for it, or ""."""
    found = []
    for text in metadata.get_all("Requires-Dist", []):
        extra = re.search(r"extra == '([^']+)'", text)
        found.append((Requirement(text), extra.group(1) if extra else ""))
    return found


def core_requirements(metadata: Message) -> list[Requirement]:
    return [requirement for requirement, extra in requirements(metadata) if not extra]


def closure(wanted: list[Requirement]) -> set[str]:
    """Distributions that these need, and those that they need."""
    names: set[str] = set()
    while wanted:
        requirement = wanted.pop()
        name = canonical(requirement.name)
        if name in names or not (requirement.marker is None or requirement.marker.evaluate({"extra": ""})):
            continue
        try:
            needed = distribution(name).requires or []
        except PackageNotFoundError:  # a CPU build of torch comes without CUDA's libraries
            continue
        names.add(name)
        wanted.extend(map(Requirement, needed))
    return names


def imported_names() -> set[str]:
    """Top-level names that the program and the library import, also late or by a string."""
    names: set[str] = set()
    for path in (*(ROOT / "app").rglob("*.py"), *(ROOT / "langflash_core").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Import):
                names |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names.add((node.module or "").partition(".")[0])
        names |= set(re.findall(r"import_module\(\"(\w+)", text))
    return names


def test_holds_every_shader_and_asset(wheel):
    with zipfile.ZipFile(wheel) as archive:
        sizes = {entry.filename: entry.file_size for entry in archive.infolist()}
    # what people read in the repository, and what only the lab draws
    left = [ROOT / name for name in ("assets/readme", "assets/report", "shaders/rooms")]
    for kind in ("shaders", "assets"):
        files = [path for path in (ROOT / kind).rglob("*") if path.is_file()]
        files = [path for path in files if not any(path.is_relative_to(folder) for folder in left)]
        assert files
        for path in files:
            name = f"langflash_core/_bundled/{path.relative_to(ROOT).as_posix()}"
            assert sizes.get(name) == path.stat().st_size, name


def test_holds_what_web_pages_are_made_of(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    page = ROOT / "langflash_core" / "export" / "page"
    assert {path.relative_to(ROOT).as_posix() for path in page.iterdir()} <= names


def test_holds_no_tests_and_no_rubbish(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    tops = {name.split("/")[0] for name in names}
    assert tops == {"langflash_app", "langflash_core", f"langflash-{langflash_core.__version__}.dist-info"}
    assert not [name for name in names if name.endswith((".pyc", ".part", ".log"))]
    assert not [name for name in names if "/lab/" in name or "/shaders/rooms/" in name]
    assert "langflash_core/py.typed" in names


def test_metadata(wheel, metadata):
    with zipfile.ZipFile(wheel) as archive:
        licences = [name for name in archive.namelist() if ".dist-info/licenses/" in name]
    assert metadata["Version"] == langflash_core.__version__
    assert metadata["License-Expression"] == "Apache-2.0"
    assert {Path(name).name for name in licences} == {"LICENSE", "NOTICE"}


def test_the_program_does_not_know_its_own_name():
    """Absolute imports of `app` would find other people's package, or none."""
    for path in (ROOT / "app").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            assert not [name for name in names if name.partition(".")[0] == "app"], path


def test_every_dependency_is_used(metadata):
    tops: dict[str, set[str]] = {}
    for top, names in packages_distributions().items():
        for name in names:
            tops.setdefault(canonical(name), set()).add(top)
    imported = imported_names()
    for requirement, extra in requirements(metadata):
        name = canonical(requirement.name)
        if extra in ("dev", "everything") or name == "langflash" or name in USED_BY_OTHERS:
            continue
        assert {*tops.get(name, ()), IMPORTED_AS.get(name, name)} & imported, f"nothing imports {name}"


def test_the_extra_that_is_named_brings_the_package(metadata):
    owners = packages_distributions()
    for top, extra in EXTRAS.items():
        unknown = [name for name, imported in IMPORTED_AS.items() if imported == top] or [
            top
        ]  # ray is called ray
        names = {canonical(name) for name in owners.get(top, unknown)}
        assert names & {canonical(r.name) for r, e in requirements(metadata) if e == extra}, top
        assert not names & {canonical(r.name) for r in core_requirements(metadata)}, top


def test_wheel_beside_another_app(installed, tmp_path):
    said = f"langflash {langflash_core.__version__}\n"
    assert installed.langflash("--version", cwd=tmp_path) == said
    assert installed.python("-m", "langflash_core", "--version", cwd=tmp_path) == said
    code = "import app, langflash_app, langflash_core; print(app.OWNER, langflash_app.__file__)"
    owner, _, place = installed.python("-c", code, cwd=tmp_path).strip().rpartition(" ")
    assert owner == "somebody else"
    assert Path(place).is_relative_to(installed.packages)


def test_checkout_beside_another_app(checkout, tmp_path):
    said = f"langflash {langflash_core.__version__}\n"
    assert checkout.langflash("--version", cwd=tmp_path) == said
    assert checkout.python("-m", "langflash_core", "--version", cwd=tmp_path) == said
    assert checkout.python("-c", "import app; print(app.OWNER)", cwd=tmp_path) == "somebody else\n"
    listed = json.loads(checkout.langflash("weights", "list", "--json", cwd=tmp_path))
    assert listed


@pytest.mark.parametrize("place", ["installed", "checkout"])
def test_the_window_finds_the_command_line(place, request, tmp_path):
    """It runs exports in a process of their own."""
    code = """
import threading
from langflash_core.__main__ import find_program
find_program()
from langflash_app.window.exporting.process import Exporter
said, done = [], threading.Event()
exporter = Exporter(lambda *_: None, lambda *words: (said.extend(words), done.set()))
exporter.start(("--version",))
print(done.wait(60), *said)
"""
    said = request.getfixturevalue(place).python("-c", code, cwd=tmp_path)
    assert said.strip() == f"True 0 langflash {langflash_core.__version__}"


def test_every_module_of_the_program_can_be_imported(installed, tmp_path):
    code = """
import importlib, pkgutil, app, langflash_app
for module in pkgutil.walk_packages(langflash_app.__path__, "langflash_app."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
        print(module.name)
"""
    names = installed.python("-c", code, cwd=tmp_path).split()
    here = [path for path in (ROOT / "app").rglob("*.py") if path.stem not in ("__init__", "__main__")]
    here = [path for path in here if not path.is_relative_to(ROOT / "app" / "cli" / "lab")]
    assert len(names) >= len(here) > 0


def test_installed_renderer_finds_its_shaders(installed, tmp_path):
    code = """
import torch
from pathlib import Path
from langflash_app.gl import SplatRenderer, offscreen_context
from langflash_core.base.resources import shader_path
from langflash_core.types import Gaussians, Scene, Semantics

one = Gaussians(torch.tensor([[0.0, 0.0, 1.0]]), torch.tensor([[1.0, 0, 0, 0]]), torch.full((1, 3), 0.2),
                torch.ones(1), torch.ones(1, 1, 3))
meaning = Semantics(torch.zeros(1, 1, dtype=torch.int64), torch.ones(1, 1), torch.ones(1, 1), "minilm")
K = torch.tensor([[[16.0, 0, 8], [0, 16.0, 8], [0, 0, 1]]])
scene = Scene(one, meaning, torch.eye(4)[None], K, (16, 16))
context = offscreen_context()
renderer = SplatRenderer(context)
renderer.set_scene(scene)
renderer.draw(scene.camera(0))
print(float(renderer.frame().alphas.max()), shader_path("splat/quad.vert"))
renderer.release()
context.release()
"""
    alpha, _, shader = installed.python("-c", code, cwd=tmp_path).strip().partition(" ")
    assert float(alpha) > 0.9  # 0.99, the largest alpha, in half precision
    assert Path(shader).is_relative_to(installed.packages)


def test_the_core_alone_does_the_work(bare, tmp_path):
    """Photos to a scene, an answer and files; where OpenGL's packages are missing, one sentence."""
    for name in EXTRAS:
        code = f"import importlib.util; print(importlib.util.find_spec({name!r}))"
        assert bare.python("-c", code, cwd=tmp_path) == "None\n", name
    photos = [asset_path(f"photos/books_{side}.jpg") for side in ("left", "right")]
    bare.langflash("reconstruct", *photos, "-o", "s.langflash", cwd=tmp_path)
    said = json.loads(bare.langflash("query", "s.langflash", "book", "-o", "q", "--json", cwd=tmp_path))
    assert [answer["prompt"] for answer in said["prompts"]] == ["book"]
    bare.langflash("export", "s.langflash", "-o", "s.ply", cwd=tmp_path)
    assert (tmp_path / "q").is_dir() and (tmp_path / "s.ply").stat().st_size > 10_000


@pytest.mark.parametrize("words", [["lab"], ["lab", "eval", "rooms"], ["eval", "rooms"]])
def test_the_lab_is_named_by_where_it_runs(bare, tmp_path, words):
    code, sentence = bare.refused(*words, cwd=tmp_path)
    assert code == 2 and "runs in a checkout of the repository" in sentence
    assert "lab" not in bare.langflash("--help", cwd=tmp_path).split()


def test_the_core_alone_says_what_is_missing(bare, tmp_path):
    for words, extra in ((["view"], "window"), (["bench", "--synthetic", "9"], "gl")):
        code, sentence = bare.refused(*words, cwd=tmp_path)
        assert code == 1 and f"langflash[{extra}]" in sentence
