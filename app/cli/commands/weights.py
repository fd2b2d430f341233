"""`langflash weights`: the checkpoints this installation holds, and whether they are sound."""

import hashlib
import json
from argparse import Namespace
from pathlib import Path
from typing import Any, TextIO

from safetensors import SafetensorError, safe_open

from app.cli.files import readable_file
from app.cli.report import write_json
from langflash_core.errors import WeightsError
from langflash_core.network import PRESETS, load_network
from langflash_core.resources import asset_path


def run(args: Namespace, out: TextIO) -> None:
    """List the shipped checkpoints, or verify those named (the shipped ones when none is).

    Raises:
        WeightsError: a checkpoint is missing, damaged, or fits no network of this version.
    """
    paths = args.paths if args.action == "verify" and args.paths else _shipped()
    entries = [_entry(path) for path in paths]
    if args.action == "verify":
        for path, entry in zip(paths, entries, strict=True):
            load_network(entry["preset"], path)
            entry["sound"] = True
    if args.json:
        write_json({"weights": entries}, out)
    else:
        print("\n".join(_line(entry) for entry in entries), file=out)


def _shipped() -> list[Path]:
    return [asset_path(f"weights/{preset}.safetensors") for preset in PRESETS]


def _entry(path: Path) -> dict[str, Any]:
    readable_file(path, "checkpoint", WeightsError)
    try:
        with safe_open(str(path), framework="np") as file:
            header = json.loads((file.metadata() or {}).get("langflash", "{}"))
    except (SafetensorError, ValueError, OSError) as problem:
        raise WeightsError(
            f"{path} is not a readable safetensors file ({problem}); train or copy it again"
        ) from None
    preset = header.get("preset")
    if preset not in PRESETS:
        raise WeightsError(f"{path} is no checkpoint of LangFlash: it names no preset; choose another file")
    with path.open("rb") as stream:
        checksum = hashlib.file_digest(stream, "sha256").hexdigest()
    return {"path": str(path), "preset": preset, "bytes": path.stat().st_size, "sha256": checksum}


def _line(entry: dict[str, Any]) -> str:
    sound = "  sound" if entry.get("sound") else ""
    size = f"{entry['bytes'] / 1e6:.1f} MB"
    return f"{entry['preset']}  {size}  sha256 {entry['sha256'][:16]}...  {entry['path']}{sound}"
