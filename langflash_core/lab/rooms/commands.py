"""What `langflash lab rooms pack | preview | render` do. Files are written whole or not at all."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from langflash_core.base.files import make_folder, write_atomically
from langflash_core.errors import InputError
from langflash_core.lab.rooms.catalogue import HELD_OUT_LIBRARIES, TRAIN_LIBRARIES
from langflash_core.lab.rooms.pack import build_pack, load_pack
from langflash_core.lab.rooms.preview import contact_sheet
from langflash_core.lab.rooms.render import RoomRenderer
from langflash_core.lab.rooms.sample import RoomViews, staged_room


def run_pack(root: Path, out: Path) -> int:
    """Build a pack from a folder of furniture libraries; returns the number of items.

    Raises:
        InputError: no library was found there.
    """
    try:
        return build_pack(Path(root), Path(out))
    except ValueError as error:
        raise InputError(
            f"{root} holds no furniture library; give the folder with the .sh3f files"
        ) from error


def run_preview(pack: Path, out_png: Path, seed: int = 0, count: int = 9, held_out: bool = False) -> Path:
    """Write a contact sheet of `count` rooms; returns its path."""
    sheet = contact_sheet(load_pack(Path(pack)), range(seed, seed + count), _libraries(held_out))
    stream = io.BytesIO()
    sheet.save(stream, "PNG")
    write_atomically(Path(out_png), stream.getvalue())
    return Path(out_png)


def run_render(
    pack: Path,
    out_dir: Path,
    seed: int = 0,
    count: int = 100,
    held_out: bool = False,
    *,
    num_views: int = 2,
    size: tuple[int, int] = (224, 224),
) -> Iterator[Path]:
    """Render rooms `seed` .. `seed + count - 1`, one `.npz` each; those that exist are skipped.

    Args:
        pack: pack file.
        out_dir: folder to fill; made when missing.
        seed: first seed.
        count: number of rooms.
        held_out: use the held-out libraries instead of the training ones.
        num_views: V.
        size: (height, width), pixels.

    Yields:
        The path of every scene, as soon as it is there; so the caller can show progress or stop.
    """
    folder, libraries = Path(out_dir), _libraries(held_out)
    furniture = load_pack(Path(pack))
    make_folder(folder)
    with RoomRenderer(furniture) as renderer:
        for number in range(seed, seed + count):
            path = folder / f"room_{number:08d}.npz"
            if not path.exists():
                views = staged_room(
                    number, furniture, renderer, num_views=num_views, size=size, libraries=libraries
                ).views
                save_views(views, path)
            yield path


def save_views(views: RoomViews, path: Path) -> None:
    """Write one sample, atomically. Names are joined by "|", one string per instance."""
    stream = io.BytesIO()
    np.savez_compressed(
        stream,
        images=views.images,
        depths=views.depths.astype(np.float16),
        instances=views.instances,
        names=np.array(["|".join(words) for words in views.names]),
        groups=np.array(views.groups),
        viewmats=views.viewmats,
        Ks=views.Ks,
        overlap=np.float32(views.overlap),
        seed=np.int64(views.seed),
    )
    write_atomically(path, stream.getvalue())


def load_views(path: Path) -> RoomViews:
    """Read what `save_views` wrote; depths come back as float32 of half precision."""
    with np.load(path) as stored:
        return RoomViews(
            images=stored["images"],
            depths=stored["depths"].astype(np.float32),
            instances=stored["instances"],
            names=tuple(tuple(words.split("|")) if words else () for words in stored["names"].tolist()),
            groups=tuple(stored["groups"].tolist()),
            viewmats=stored["viewmats"],
            Ks=stored["Ks"],
            overlap=float(stored["overlap"]),
            seed=int(stored["seed"]),
        )


def _libraries(held_out: bool) -> tuple[str, ...]:
    return HELD_OUT_LIBRARIES if held_out else TRAIN_LIBRARIES
