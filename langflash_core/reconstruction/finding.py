"""What the network finds in the views, kept where a folder for that was named."""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, fields, replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from langflash_core.base.keeping import Arrays, Keep, not_kept
from langflash_core.base.records import FoundFocal, FoundLens
from langflash_core.base.running import Kept, Run
from langflash_core.errors import WeightsError
from langflash_core.network import PRESETS
from langflash_core.network.checkpoints.parts import part_folder
from langflash_core.network.checkpoints.stored import weights_file
from langflash_core.reconstruction.ahead import Ahead
from langflash_core.reconstruction.options import Options
from langflash_core.reconstruction.tools import Tools
from langflash_core.types import Gaussians, Prediction, Views

_SAID = "said"
_OWN = "gaussians."
_HELPED = "the graphics card could not run the network, so the processor did; choose --device cpu to skip it"
_TENSORS = ("weights", "dictionary", "viewmats", "depths", "confidences", "Ks")


def predictor(options: Options, tools: Tools, ahead: Ahead, run: Run) -> Callable[[Views], Prediction]:
    """Views to what the network finds in them, on the CPU; what `options.keep` holds is not done again."""

    def found(views: Views, kept: Kept) -> Prediction:
        predict = partial(_predict_scene, views, kept, tools, ahead, run)
        return with_help(predict, tools.network) if options.device == "mps" else predict()

    def predicted(views: Views) -> Prediction:
        if options.keep is None:
            return found(views, not_kept)
        kept = keep_of(options.keep, views, _settings(options, tools), ahead.gone_on)
        return prediction_of(kept("prediction", lambda: arrays_of(found(views, kept))))

    return predicted


def with_help(predict: Callable[[], Prediction], network: nn.Module) -> Prediction:
    """What `predict` finds; where the network's device cannot do something, on the processor. There the
    network then stays: scenes after this one are not told again."""
    with suppress(RuntimeError, TypeError):  # no such operation, kind of number or memory
        return predict()
    network.to("cpu")  # after the error is gone, which holds what filled the card
    found = predict()
    return replace(found, warnings=(*found.warnings, _HELPED))


def keep_of(folder: Path, views: Views, settings: tuple, found: list[str] | None = None) -> Keep:
    """Where what these views become is kept; hangs on all that changes a bit of it. found: as of `Keep`."""
    machine = (torch.__version__, torch.get_num_threads(), torch.backends.cpu.get_cpu_capability())
    said = {"settings": settings, "machine": machine, "names": views.names, "lenses": views.lenses}
    numbers = [views.images, views.Ks] + ([] if views.viewmats is None else [views.viewmats])
    parts = (values.contiguous().numpy().tobytes() for values in numbers)
    return Keep.of(folder, said, (*views.sources, *parts), found)


def _predict_scene(views: Views, kept: Kept, tools: Tools, ahead: Ahead, run: Run) -> Prediction:
    prediction = tools.network.predict(
        views,
        run.within("network"),
        run.cancelled,
        tools.atoms,
        tools.groups,
        tools.redrawn,
        tools.finer is None,
        ahead.with_keypoints(kept, views.sources),
    )
    tensors = {name: value.cpu() for name, value in vars(prediction).items() if isinstance(value, Tensor)}
    return replace(prediction, gaussians=prediction.gaussians.map(Tensor.cpu), **tensors)


def _settings(options: Options, tools: Tools) -> tuple:
    return (
        options.preset,
        options.device,
        options.precision,
        options.aggregation,
        options.grouping,
        tools.finer is None,
        _identity(options.preset, options.weights),
    )


def _identity(preset: str, weights: Path | str | None) -> list[tuple[str, int, int]]:
    """Which weights: the checkpoint and its installed parts, with size and time of change."""
    files = sorted(part_folder(PRESETS[preset]).glob("*.safetensors"))
    with suppress(WeightsError):  # there may be no file but the parts
        files.append(weights_file(preset, None if weights is None else Path(weights)))
    return [(path.name, path.stat().st_size, path.stat().st_mtime_ns) for path in files if path.is_file()]


def arrays_of(prediction: Prediction) -> Arrays:
    """All of a prediction, on the CPU, to be kept."""
    said = {
        "space": prediction.space,
        "unplaced": prediction.unplaced,
        "warnings": prediction.warnings,
        "timings": prediction.timings,
        "lenses": [asdict(lens) for lens in prediction.lenses],
        "bent": [lens and asdict(lens) for lens in prediction.bent],
    }
    found = {_SAID: np.frombuffer(json.dumps(said).encode(), np.uint8)}
    for name in _TENSORS:
        values = getattr(prediction, name)
        if values is not None:
            found[name] = values.detach().cpu().numpy()
    for each in fields(Gaussians):
        values = getattr(prediction.gaussians, each.name)
        if isinstance(values, Tensor):
            found[_OWN + each.name] = values.detach().cpu().numpy()
    return found


def prediction_of(arrays: Arrays) -> Prediction:
    """The one that `arrays_of` had, to the same bits."""
    said = json.loads(bytes(arrays[_SAID]))
    own = {
        each.name: torch.from_numpy(arrays[_OWN + each.name])
        for each in fields(Gaussians)
        if _OWN + each.name in arrays
    }
    tensors = {name: torch.from_numpy(arrays[name]) for name in _TENSORS if name in arrays}
    return Prediction(
        gaussians=Gaussians(**own),
        space=said["space"],
        unplaced=tuple(said["unplaced"]),
        warnings=tuple(said["warnings"]),
        timings=said["timings"],
        lenses=tuple(FoundLens(**lens) for lens in said["lenses"]),
        bent=tuple(lens and FoundFocal(**lens) for lens in said["bent"]),
        **tensors,
    )
