"""`langflash lab bench-network`: how long each stage of the network takes, and what bfloat16 costs."""

import math
import platform
from argparse import Namespace
from dataclasses import asdict
from pathlib import Path
from typing import TextIO

from langflash_core.base.files import check_output_file, readable_file
from langflash_core.errors import InputError, WeightsError

from ..report import ProgressBar, write_json


def run(args: Namespace, out: TextIO) -> None:
    """Measure, print the paper's table or JSON.

    Raises:
        LangFlashError: the weights or the device cannot be used.
    """
    if args.weights is not None:
        readable_file(args.weights, "checkpoint", WeightsError)
    if args.output is not None:
        check_output_file(args.output, (".json",))
    import torch

    from langflash_core.base.devices import chosen_device
    from langflash_core.base.memory import peak_memory_mb
    from langflash_core.lab.evaluation.speed import Plan, measure_network, speed_table
    from langflash_core.network import PRESETS

    device = chosen_device(args.device)
    side = args.size or math.isqrt(PRESETS[args.preset].native_area)
    plan = Plan(tuple(args.views), tuple(args.atoms), args.repeats, side, not args.float32)
    with ProgressBar() as progress:
        progress("weights", 0.0)
        network = _network(args, device)
        if side % network.preset.patch:
            raise InputError(
                f"the size {side} does not fit; choose a multiple of {network.preset.patch} with --size"
            )
        if args.compile:
            network.compiled()
        rows = measure_network(network, plan, progress)
    memory = torch.cuda.max_memory_allocated() / 1e6 if device == "cuda" else peak_memory_mb()
    document = {
        "preset": args.preset,
        "weights": "random" if args.random else str(args.weights or "default"),
        "device": torch.cuda.get_device_name()
        if device == "cuda"
        else platform.processor() or platform.machine(),
        "threads": torch.get_num_threads(),
        "torch": torch.__version__,
        "size": side,
        "compiled": args.compile,
        "peak_memory_mb": None if memory is None else round(memory),
        "rows": [asdict(row) for row in rows],
    }
    if args.output is not None:
        _write(args.output, document)
    if args.json:
        write_json(document, out)
    else:
        print(f"{speed_table(rows)}\n\npeak memory {document['peak_memory_mb']} MB", file=out)


def _network(args: Namespace, device: str):
    """Loaded, or drawn at random: time does not depend on what the numbers are."""
    import torch

    from langflash_core.network import PRESETS, build_network, load_network
    from langflash_core.network.checkpoints.store import channels_last

    if not args.random:
        try:
            return load_network(args.preset, args.weights, device)
        except WeightsError as error:
            raise WeightsError(f"{error}; --random measures without weights") from None
    torch.manual_seed(0)
    network = build_network(PRESETS[args.preset]).eval()
    return (network if network.compact else channels_last(network)).to(device)


def _write(path: Path, document: dict) -> None:
    import io

    from langflash_core.base.files import make_folder, write_atomically

    stream = io.StringIO()
    write_json(document, stream)
    make_folder(path.parent)
    write_atomically(path, stream.getvalue().encode())
