"""`langflash weights`: the checkpoints at hand, those that can be had, and whether they are sound."""

import hashlib
import json
from argparse import Namespace
from contextlib import suppress
from pathlib import Path
from typing import Any, TextIO

from safetensors import SafetensorError, safe_open

from langflash_core.base.files import readable_file
from langflash_core.base.resources import asset_path, weights_folder
from langflash_core.errors import WeightsError
from langflash_core.network import PRESETS, load_network
from langflash_core.network.checkpoints.catalogue import CATALOGUE, CLIP, OTHERS, SAM2, find_published
from langflash_core.network.checkpoints.download import download
from langflash_core.network.checkpoints.parts import FORMAT, part_folder, read_part
from langflash_core.network.checkpoints.store import install, verify_part

from ..report import ProgressBar, say_warnings, tell


def run(args: Namespace, out: TextIO) -> None:
    """List, verify, import or get checkpoints."""
    {"list": _list, "verify": _verify, "import": _import, "get": _get}[args.action](args, out)


def _list(args: Namespace, out: TextIO) -> None:
    entries = [_entry(path) for path in _present()]
    told = ("name", "preset", "part", "about", "licence", "url")
    available = [{name: getattr(p, name) for name in told} for p in (*CATALOGUE, *OTHERS)]
    lines = [*map(_line, entries), "", "to be had with `langflash weights get NAME`:"]
    lines += [f"  {p['name']:<24}{p['part']:<10}{p['about']}; licence: {p['licence']}" for p in available]
    document = {"weights": entries, "available": available, "folder": str(weights_folder())}
    tell(args, document, lines, out)


def _verify(args: Namespace, out: TextIO) -> None:
    paths = args.paths or _present()
    entries = [_entry(path) for path in paths]
    for path, entry in zip(paths, entries, strict=True):
        if "modules" in entry:
            verify_part(path, PRESETS[entry["preset"]])
        else:
            load_network(entry["preset"], path)
        entry["sound"] = True
    tell(args, {"weights": entries}, map(_line, entries), out)


def _import(args: Namespace, out: TextIO) -> None:
    readable_file(args.path, "checkpoint", WeightsError)
    _installed(args, out, args.path, args.output)


def _get(args: Namespace, out: TextIO) -> None:
    entry = find_published(args.name)
    if entry is CLIP:
        from langflash_core.language.clip import fetch_clip

        _say_file(args, out, fetch_clip())
        return
    if entry is SAM2:
        with ProgressBar() as progress:
            _say_file(args, out, download(entry.url, weights_folder() / entry.file, progress))
        return
    target = weights_folder() / "downloads" / f"{entry.name}-{entry.file}"
    with ProgressBar() as progress:
        if not target.is_file():
            download(entry.url, target, progress)
        progress("converting", 1.0)
        _installed(args, out, target, None)
    if not args.keep:
        target.unlink()


def _say_file(args: Namespace, out: TextIO, path: Path) -> None:
    document = {"weights": [{"path": str(path), "bytes": path.stat().st_size}]}
    tell(args, document, [str(path)], out)


def _installed(args: Namespace, out: TextIO, checkpoint: Path, output: Path | None) -> None:
    preset = PRESETS[args.preset] if "preset" in args else PRESETS[find_published(args.name).preset]
    done = install(checkpoint, preset, output, side=getattr(args, "size", None))
    part, *others = done.paths
    entries = [_entry(part), *({"path": str(p), "bytes": p.stat().st_size} for p in others)]
    tell(args, {"weights": entries}, map(_line, entries), out)
    say_warnings(done.notes)


def _present() -> list[Path]:
    """Shipped checkpoints, then imported parts."""
    present = []
    for name in PRESETS:
        with suppress(FileNotFoundError):
            present.append(asset_path(f"weights/{name}.safetensors"))
    for preset in PRESETS.values():
        present += sorted(part_folder(preset).glob("*.safetensors"))
    return present


def _entry(path: Path) -> dict[str, Any]:
    readable_file(path, "checkpoint", WeightsError)
    try:
        with safe_open(str(path), framework="np") as file:
            header = json.loads((file.metadata() or {}).get("langflash", "{}"))
    except (SafetensorError, ValueError, OSError) as problem:
        raise WeightsError(
            f"{path} is not a readable safetensors file ({problem}); train, import or copy it again"
        ) from None
    preset = header.get("preset")
    if preset not in PRESETS:
        raise WeightsError(f"{path} is no checkpoint of LangFlash: it names no preset; choose another file")
    with path.open("rb") as stream:
        checksum = hashlib.file_digest(stream, "sha256").hexdigest()
    entry = {"path": str(path), "preset": preset, "bytes": path.stat().st_size, "sha256": checksum}
    if header.get("format") == FORMAT:
        part = read_part(path)
        entry |= {"modules": list(part.modules), "origin": part.origin, "source": part.source}
    return entry


def _line(entry: dict[str, Any]) -> str:
    size = f"{entry['bytes'] / 1e6:,.1f} MB"
    if "preset" not in entry:
        return f"      {size}  {entry['path']}"
    sound = "  sound" if entry.get("sound") else ""
    origin = f"  ({entry['origin']}, {entry['source']})" if entry.get("origin") else ""
    return f"{entry['preset']}  {size}  sha256 {entry['sha256'][:16]}...  {entry['path']}{origin}{sound}"
