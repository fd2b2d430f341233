"""Weights of DeepLab out of a file of TensorFlow Lite: one with its layers, in 8 bits, and others."""

import flatbuffers
import numpy as np
import pytest
import torch
from ai_edge_litert import schema_py_generated as schema

from langflash_core.errors import InputError
from langflash_core.lab.labels.lite import read_deeplab
from langflash_core.network.encoders.deeplab import DeepLab

PUBLISHED = {
    "stem": "MobilenetV2/Conv/Relu6",
    "near": "aspp0/Relu",
    "whole": "image_pooling/Relu",
    "both": "concat_projection/Relu",
    "fine": "decoder/feature_projection0/Relu",
    "last.0.depthwise": "decoder/decoder_conv0_depthwise/Relu",
    "last.0.pointwise": "decoder/decoder_conv0_pointwise/Relu",
    "last.1.depthwise": "decoder/decoder_conv1_depthwise/Relu",
    "last.1.pointwise": "decoder/decoder_conv1_pointwise/Relu",
}
"""Names that its layers have in the published file."""


def published(name: str) -> str:
    if name in PUBLISHED:
        return PUBLISHED[name]
    _, place, layer = name.split(".")
    block = "expanded_conv" + ("" if place == "0" else f"_{place}")
    return f"MobilenetV2/{block}/{layer}/" + ("add_fold" if layer == "project" else "Relu6")


class Writer:
    """A file of convolutions side by side, each with an input of its own: all that weights are read from."""

    def __init__(self) -> None:
        self.tensors: list[schema.TensorT] = []
        self.buffers = [schema.BufferT()]
        self.steps: list[schema.OperatorT] = []
        self.inputs: list[int] = []
        self.outputs: list[int] = []

    def tensor(self, name: str, shape, type, scale: float, zero: int, data: np.ndarray | None = None) -> int:
        one = schema.TensorT()
        one.name, one.shape, one.type = name, [int(n) for n in shape], type
        one.quantization = schema.QuantizationParametersT()
        one.quantization.scale, one.quantization.zeroPoint = [scale], [zero]
        one.buffer = 0
        if data is not None:
            buffer = schema.BufferT()
            buffer.data = np.ascontiguousarray(data).ravel().view(np.uint8)  # pyright: ignore[reportAttributeAccessIssue]
            one.buffer = len(self.buffers)
            self.buffers.append(buffer)
        self.tensors.append(one)
        return len(self.tensors) - 1

    def convolution(self, name: str, layer: torch.nn.Conv2d, random: np.random.Generator) -> None:
        """A layer with random steps of 8 bits, which `layer` then has."""
        outputs, inputs = layer.weight.shape[:2]
        depthwise = layer.groups > 1
        steps = random.integers(0, 256, layer.weight.shape).astype(np.uint8)
        bias = random.integers(-999, 999, outputs).astype(np.int32)
        scale, zero = float(np.float32(random.uniform(0.01, 0.1))), int(random.integers(100, 150))
        with torch.no_grad():
            layer.weight.copy_(torch.from_numpy((steps.astype(np.float64) - zero) * np.float32(scale)))
            layer.bias.copy_(torch.from_numpy(bias * np.float64(np.float32(scale / 128))))  # type: ignore[union-attr]
        kernel = steps.transpose(1, 2, 3, 0) if depthwise else steps.transpose(0, 2, 3, 1)
        channels = outputs if depthwise else inputs
        uint8, int32 = schema.TensorType.UINT8, schema.TensorType.INT32
        given = self.tensor(f"in_{name}", [1, 4, 4, channels], uint8, 1 / 128, 128)
        weight = self.tensor(f"{name}_weights", kernel.shape, uint8, scale, zero, kernel)
        added = self.tensor(f"{name}_bias", [outputs], int32, scale / 128, 0, bias)
        result = self.tensor(name, [1, 4, 4, outputs], uint8, 1.0, 0)
        step = schema.OperatorT()
        step.opcodeIndex, step.inputs, step.outputs = int(depthwise), [given, weight, added], [result]
        options = schema.DepthwiseConv2DOptionsT() if depthwise else schema.Conv2DOptionsT()
        options.strideH = options.strideW = options.dilationHFactor = options.dilationWFactor = 1
        options.padding = schema.Padding.SAME
        kinds = schema.BuiltinOptions
        step.builtinOptionsType = kinds.DepthwiseConv2DOptions if depthwise else kinds.Conv2DOptions
        if isinstance(options, schema.DepthwiseConv2DOptionsT):
            options.depthMultiplier = 1
        step.builtinOptions = options
        self.steps.append(step)
        self.inputs.append(given)
        self.outputs.append(result)

    def write(self, path) -> None:
        codes = []
        for kind in (schema.BuiltinOperator.CONV_2D, schema.BuiltinOperator.DEPTHWISE_CONV_2D):
            code = schema.OperatorCodeT()
            code.builtinCode = code.deprecatedBuiltinCode = kind
            codes.append(code)
        graph = schema.SubGraphT()
        graph.tensors, graph.operators = self.tensors, self.steps
        graph.inputs, graph.outputs = self.inputs, self.outputs
        model = schema.ModelT()
        model.version, model.operatorCodes, model.subgraphs, model.buffers = 3, codes, [graph], self.buffers
        builder = flatbuffers.Builder(1 << 22)
        builder.Finish(model.Pack(builder), b"TFL3")
        path.write_bytes(bytes(builder.Output()))


def written(path, leave: str = "") -> DeepLab:
    """A file of random weights; layers whose names begin with `leave` are not in it."""
    network, writer, random = DeepLab(), Writer(), np.random.default_rng(0)
    for name, layer in network.named_modules():
        if isinstance(layer, torch.nn.Conv2d) and not (leave and name.startswith(leave)):
            writer.convolution(published(name), layer, random)
    writer.write(path)
    return network


def test_weights_are_found_by_the_names_of_layers(tmp_path):
    network = written(tmp_path / "net.tflite")
    found = read_deeplab(tmp_path / "net.tflite")
    own = network.state_dict()
    assert found.keys() == own.keys()
    for name, value in own.items():
        assert torch.equal(found[name], value), name


@pytest.mark.parametrize("layer", ["blocks.9.depthwise", "near"])
def test_another_network_is_refused(tmp_path, layer):
    written(tmp_path / "net.tflite", leave=layer)
    with pytest.raises(InputError, match=f"no layer {layer}.*MLCommons"):
        read_deeplab(tmp_path / "net.tflite")


def test_what_is_no_network_is_refused(tmp_path):
    (tmp_path / "no.tflite").write_bytes(b"no network")
    with pytest.raises(InputError, match="no TensorFlow Lite network"):
        read_deeplab(tmp_path / "no.tflite")
