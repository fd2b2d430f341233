"""Weights of DeepLab and MOSAIC out of files of TensorFlow Lite, with weights in 8 bits, as float32.

Convolutions stand in a file in the order in which they run, as those of our own networks do; their names say
little. A batch norm may follow as a product and a sum of channels: both go into the convolution.
"""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from langflash_core.errors import InputError
from langflash_core.lab.labels.ade import NAMES
from langflash_core.network.encoders.deeplab import CHANNELS, LARGE, DeepLab
from langflash_core.network.encoders.mosaic import Mosaic

_KINDS = ("CONV_2D", "DEPTHWISE_CONV_2D")


def opened_lite(path: Path, threads: int = 1) -> Any:
    """Google's interpreter of a TensorFlow Lite network, ready to run.

    Raises:
        InputError: the file is no such network.
    """
    from ai_edge_litert.interpreter import Interpreter

    try:
        with warnings.catch_warnings():  # it asks whether one means to read what lies inside
            warnings.simplefilter("ignore", UserWarning)
            network = Interpreter(str(path), num_threads=threads, experimental_preserve_all_tensors=True)
        network.allocate_tensors()
    except (ValueError, RuntimeError) as error:
        raise InputError(f"{path} is no TensorFlow Lite network ({error}); give a .tflite file") from None
    return network


@dataclass
class _Layer:
    """weight (outputs, inputs, rows, columns) and bias (outputs,), float64."""

    weight: np.ndarray
    bias: np.ndarray


def read_others(deeplab: Path, mosaic: Path) -> dict[str, Tensor]:
    """Float32 tensors of `OtherEyes`, by its own names.

    Raises:
        InputError: a file holds another network.
    """
    both = {"deeplab": _tensors_of(deeplab, DeepLab()), "mosaic": _tensors_of(mosaic, Mosaic())}
    return {f"{name}.{key}": value for name, tensors in both.items() for key, value in tensors.items()}


def read_scores(deeplab: Path) -> tuple[Float[Tensor, "N F"], Float[Tensor, " N"]]:
    """Weight (N, F) and bias (N,), float32, of the layer that scores ADE20K's names (`ade.NAMES`) by the maps
    that `DeepLab` gives.

    Raises:
        InputError: the file has no such layer.
    """
    shape = (len(NAMES), CHANNELS, 1, 1)
    own = next((layer for layer in _convolutions(opened_lite(deeplab)) if layer.weight.shape == shape), None)
    if own is None:
        raise InputError(
            f"{deeplab} does not score the {len(NAMES) - 1} names of ADE20K; NOTICE says which file does"
        )
    weight = torch.from_numpy(own.weight[:, :, 0, 0] * LARGE).float()
    return weight, torch.from_numpy(own.bias).float()


def _tensors_of(path: Path, network: nn.Module) -> dict[str, Tensor]:
    """Tensors for a network of convolutions whose modules stand in the order in which they run. What a file
    has besides (layers that only give its scores) is left."""
    found = iter(_convolutions(opened_lite(path)))
    tensors: dict[str, Tensor] = {}
    for name, module in network.named_modules():
        if not isinstance(module, nn.Conv2d):
            continue
        own = next((layer for layer in found if layer.weight.shape == tuple(module.weight.shape)), None)
        if own is None:
            raise InputError(
                f"{path} is not the {type(network).__name__} that is read here (no layer {name}); NOTICE "
                "says which two files these are"
            )
        tensors[f"{name}.weight"] = torch.from_numpy(np.ascontiguousarray(own.weight, np.float32))
        tensors[f"{name}.bias"] = torch.from_numpy(own.bias.astype(np.float32))
    return tensors


def _convolutions(network: Any) -> list[_Layer]:
    """Every convolution, as it runs; what cannot be read is left."""
    details = {detail["index"]: detail for detail in network.get_tensor_details()}
    packed: dict[int, int] = {}  # what is unpacked -> what it is unpacked from
    found: list[_Layer] = []

    def values(index: int) -> np.ndarray:
        index = packed.get(index, index)
        return _unpacked(network.get_tensor(index), details[index]["quantization_parameters"])

    def of_channels(index: int) -> bool:
        return index in details and found != [] and tuple(details[index]["shape"]) == found[-1].bias.shape

    for step in network._get_ops_details():  # the interpreter says it nowhere else
        kind, inputs = step["op_name"], [int(index) for index in step["inputs"]]
        if kind == "DEQUANTIZE":
            packed[int(step["outputs"][0])] = inputs[0]
        elif kind in _KINDS:
            order = (3, 0, 1, 2) if kind == _KINDS[1] else (0, 3, 1, 2)
            found.append(_Layer(values(inputs[1]).transpose(order), values(inputs[2])))
        elif kind == "MUL" and of_channels(inputs[1]):
            factors = values(inputs[1])
            found[-1] = _Layer(found[-1].weight * factors[:, None, None, None], found[-1].bias * factors)
        elif kind == "ADD" and of_channels(inputs[1]):
            found[-1].bias = found[-1].bias + values(inputs[1])
    return found


def _unpacked(stored: np.ndarray, steps: dict) -> np.ndarray:
    """Whole numbers as float64, by one step or one a channel; floats as they are."""
    scales, zeros = steps["scales"].astype(np.float64), steps["zero_points"].astype(np.float64)
    if not len(scales):
        return stored.astype(np.float64)
    shape = [1] * stored.ndim
    if len(scales) > 1:
        shape[steps["quantized_dimension"]] = -1
    return (stored.astype(np.float64) - zeros.reshape(shape)) * scales.reshape(shape)
