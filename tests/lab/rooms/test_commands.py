"""Commands on files: resumable, whole or not at all."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from langflash_core.errors import InputError
from langflash_core.lab.rooms.commands import load_views, run_pack, run_preview, run_render
from tests.lab.rooms.conftest import TINY_PACK


@pytest.mark.usefixtures("renderer")
def test_render_resumes(tmp_path: Path) -> None:
    paths = list(run_render(TINY_PACK, tmp_path, seed=3, count=2, held_out=True, size=(56, 56)))
    assert sorted(tmp_path.iterdir()) == sorted(paths)
    views = load_views(paths[0])
    assert views.seed == 3 and views.images.shape == (2, 56, 56, 3)
    assert views.names[0] == () and len(views.names) == len(views.groups)
    stamp = paths[0].stat().st_mtime_ns
    paths[1].unlink()
    list(run_render(TINY_PACK, tmp_path, seed=3, count=2, held_out=True, size=(56, 56)))
    assert paths[0].stat().st_mtime_ns == stamp and paths[1].exists()


@pytest.mark.usefixtures("renderer")
def test_preview_writes_a_sheet(tmp_path: Path) -> None:
    out = run_preview(TINY_PACK, tmp_path / "sheet.png", seed=1, count=1, held_out=True)
    sheet = np.asarray(Image.open(out))
    assert sheet.shape == (3 * 224 + 4, 2 * 224, 3) and sheet.std() > 10


def test_pack_needs_libraries(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="sh3f"):
        run_pack(tmp_path, tmp_path / "pack.npz")
