"""Weights of DeepLab out of the TensorFlow Lite file that MLCommons publishes, in 8 bits, as float32.

Found by the names that its layers had while it was trained; batch norms are in the convolutions already.
"""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from langflash_core.errors import InputError
from langflash_core.network.encoders.deeplab import DeepLab

_NAMES = {
    "stem": ("MobilenetV2/Conv/",),
    "near": ("aspp0",),
    "whole": ("image_pooling",),
    "both": ("concat_projection",),
    "fine": ("feature_projection0",),
    "last.0.depthwise": ("decoder_conv0_depthwise",),
    "last.0.pointwise": ("decoder_conv0_pointwise",),
    "last.1.depthwise": ("decoder_conv1_depthwise",),
    "last.1.pointwise": ("decoder_conv1_pointwise",),
}
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


def read_deeplab(path: Path) -> dict[str, Tensor]:
    """Float32 tensors of `DeepLab` by its own names.

    Raises:
        InputError: the file holds another network.
    """
    found = _convolutions(opened_lite(path))
    network = DeepLab()
    tensors: dict[str, Tensor] = {}
    for name, module in network.named_modules():
        if not isinstance(module, torch.nn.Conv2d):
            continue
        own = [layer for layer in found if all(part in layer[0] for part in _parts(name))]
        if len(own) != 1 or own[0][1].shape != tuple(module.weight.shape):
            raise InputError(
                f"{path} is not the DeepLab of 32 names on MobileNetV2 (no layer {name}); give that one, "
                "vision/deeplab in MLCommons' mobile_open"
            )
        tensors[f"{name}.weight"], tensors[f"{name}.bias"] = map(torch.from_numpy, own[0][1:])
    return tensors


def _parts(name: str) -> tuple[str, ...]:
    if not name.startswith("blocks."):
        return _NAMES[name]
    _, place, layer = name.split(".")
    number = "" if place == "0" else f"_{place}"
    return (f"expanded_conv{number}/{layer}/",)


def _convolutions(network: Any) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Name, weight (outputs, inputs, rows, columns) and bias of every convolution; unknown ones are left."""
    details = {detail["index"]: detail for detail in network.get_tensor_details()}

    def values(index: int) -> np.ndarray:
        steps = details[index]["quantization_parameters"]
        whole = network.get_tensor(index).astype(np.float64)
        return (whole - steps["zero_points"][0]) * steps["scales"][0]

    found = []
    for layer in network._get_ops_details():  # the interpreter says it nowhere else
        if layer["op_name"] not in _KINDS:
            continue
        _, weight, bias = (int(index) for index in layer["inputs"])
        order = (3, 0, 1, 2) if layer["op_name"] == _KINDS[1] else (0, 3, 1, 2)
        if details[weight]["quantization_parameters"]["scales"].size != 1 or values(weight).ndim != 4:
            continue
        numbers = np.ascontiguousarray(values(weight).transpose(order), np.float32)
        found.append((details[int(layer["outputs"][0])]["name"], numbers, values(bias).astype(np.float32)))
    return found
