"""A prediction as arrays, and back, to the same bits: what is kept of a network's work (`keeping`)."""

import json
from dataclasses import asdict, fields

import numpy as np
import torch
from torch import Tensor

from langflash_core.base.keeping import Arrays
from langflash_core.base.records import FoundFocal, FoundLens
from langflash_core.types import Gaussians, Prediction

_SAID = "said"
_OWN = "gaussians."
_TENSORS = ("weights", "dictionary", "viewmats", "depths", "confidences", "Ks")


def arrays_of(prediction: Prediction) -> Arrays:
    """All of it; on the CPU."""
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
    """The one that `arrays_of` had."""
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
