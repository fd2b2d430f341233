"""A small scene on disk whose dictionary holds real text embeddings, and a way to run commands."""

import io
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from app.cli import main
from langflash_core.language.spaces import language_space
from langflash_core.scene.file import save
from langflash_core.types import Gaussians, Record, Scene, Semantics

WORDS = ("armchair", "floor lamp", "wooden floor")
WIDTH, HEIGHT = 56, 42


@dataclass(frozen=True)
class Outcome:
    """What one command did."""

    code: int
    out: str
    err: str

    def json(self) -> dict:
        return json.loads(self.out)


@pytest.fixture
def run(capsys):
    """`run("query", scene, "armchair", ...)` in this process."""

    def command(*words) -> Outcome:
        code = main([str(word) for word in words])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return command


@pytest.fixture
def done(run):
    """As `run`, of a command that must come to its end."""

    def command(*words) -> Outcome:
        outcome = run(*words)
        assert outcome.code == 0, outcome.err
        return outcome

    return command


@pytest.fixture
def refused(run, tmp_path):
    """Run a command that must be refused, by one sentence, with nothing written; returns the sentence."""

    def command(*words, warned: bool = False) -> str:
        before = _content(tmp_path)
        outcome = run(*words)
        assert outcome.code == 2 and outcome.out == "", outcome
        said = [line for line in outcome.err.splitlines() if not (warned and line.startswith("warning: "))]
        assert len(said) == 1 and said[0].startswith("langflash: ") and outcome.err.endswith("\n"), said
        assert _content(tmp_path) == before
        return outcome.err

    return command


def shell(*words, **how) -> subprocess.CompletedProcess[str]:
    """A command in a process of its own."""
    program = [sys.executable, "-m", "langflash_core", *map(str, words)]
    return subprocess.run(program, capture_output=True, text=True, timeout=60, **how)


def _content(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() if path.is_file() else b"" for path in folder.rglob("*")}


def pixels(path: Path) -> np.ndarray:
    """Of a picture file."""
    return np.asarray(Image.open(path))


def stripes() -> Scene:
    """A wall one unit ahead: left third one word, middle the next, right the last."""
    ys, xs = torch.meshgrid(torch.linspace(-0.6, 0.6, 42), torch.linspace(-0.8, 0.8, 56), indexing="ij")
    means = torch.stack((xs, ys, torch.ones_like(xs)), -1).reshape(-1, 3)
    count = len(means)
    atoms = ((means[:, 0] + 0.8) / 1.6 * len(WORDS)).long().clamp(0, len(WORDS) - 1)
    gaussians = Gaussians(
        means=means,
        quats=torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(count, 1),
        scales=torch.full((count, 3), 0.02),
        opacities=torch.full((count,), 0.95),
        sh=torch.eye(3)[atoms][:, None, :] * 1.5,
    )
    dictionary = language_space("minilm").encode(WORDS)
    semantics = Semantics(atoms[:, None], torch.ones(count, 1), dictionary, "minilm")
    K = torch.tensor([[35.0, 0.0, WIDTH / 2], [0.0, 35.0, HEIGHT / 2], [0.0, 0.0, 1.0]])
    second = torch.eye(4)
    second[0, 3] = -0.1
    return Scene(
        gaussians,
        semantics,
        viewmats=torch.stack((torch.eye(4), second)),
        Ks=torch.stack((K, K)),
        view_size=(WIDTH, HEIGHT),
        record=Record(preset="mini"),
    )


def striped_photo(seed: int) -> bytes:
    """Three stripes of different texture, as the groups of the scene lie."""
    rng, stream = np.random.default_rng(seed), io.BytesIO()
    pixels = rng.normal(128, 6, (HEIGHT, WIDTH, 3))
    pixels[:, : WIDTH // 3] += 90 * np.sin(np.arange(HEIGHT))[:, None, None]
    pixels[:, WIDTH // 3 : 2 * WIDTH // 3, 0] += 80
    pixels[:, 2 * WIDTH // 3 :] -= 90
    Image.fromarray(pixels.clip(0, 255).astype(np.uint8)).save(stream, "JPEG", quality=92)
    return stream.getvalue()


@pytest.fixture(scope="session")
def scene_file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "stripes.langflash"
    save(stripes(), path)
    return path
