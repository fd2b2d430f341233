"""Weights of DeepLab and MOSAIC out of files of TensorFlow Lite: with their layers, in 8 bits, and others."""

import flatbuffers
import numpy as np
import pytest
import torch
from ai_edge_litert import schema_py_generated as schema

from langflash_core.errors import InputError
from langflash_core.lab.labels.ade import NAMES
from langflash_core.lab.labels.lite import read_others, read_scores
from langflash_core.network.encoders.deeplab import CHANNELS, LARGE, DeepLab
from langflash_core.network.encoders.mosaic import Mosaic
from langflash_core.network.encoders.others import OtherEyes

KINDS = ("CONV_2D", "DEPTHWISE_CONV_2D", "DEQUANTIZE", "MUL", "ADD")
UINT8, INT8, INT32, FLOAT = (
    getattr(schema.TensorType, name) for name in ("UINT8", "INT8", "INT32", "FLOAT32")
)


class Writer:
    """A file of convolutions side by side, each with an input of its own: all that weights are read from."""

    def __init__(self) -> None:
        self.tensors: list[schema.TensorT] = []
        self.buffers = [schema.BufferT()]
        self.steps: list[schema.OperatorT] = []
        self.inputs: list[int] = []
        self.outputs: list[int] = []

    def tensor(self, shape, type, scale=(), zero=(), data: np.ndarray | None = None, along: int = 0) -> int:
        one = schema.TensorT()
        one.name, one.shape, one.type = f"t{len(self.tensors)}", [int(n) for n in shape], type
        if len(scale):
            one.quantization = schema.QuantizationParametersT()
            one.quantization.scale, one.quantization.zeroPoint = list(scale), list(zero)
            one.quantization.quantizedDimension = along
        one.buffer = 0
        if data is not None:
            buffer = schema.BufferT()
            buffer.data = np.ascontiguousarray(data).ravel().view(np.uint8)  # pyright: ignore[reportAttributeAccessIssue]
            one.buffer = len(self.buffers)
            self.buffers.append(buffer)
        self.tensors.append(one)
        return len(self.tensors) - 1

    def step(self, kind: str, inputs: list[int], output: int, options=None) -> int:
        one = schema.OperatorT()
        one.opcodeIndex, one.inputs, one.outputs = KINDS.index(kind), inputs, [output]
        if options is not None:
            name = type(options).__name__.removesuffix("T")
            one.builtinOptionsType, one.builtinOptions = getattr(schema.BuiltinOptions, name), options
        self.steps.append(one)
        return output

    def convolved(self, layer: torch.nn.Conv2d, given: int, weight: int, bias: int, result: int) -> int:
        depthwise = layer.groups > 1
        options = schema.DepthwiseConv2DOptionsT() if depthwise else schema.Conv2DOptionsT()
        options.strideH = options.strideW = options.dilationHFactor = options.dilationWFactor = 1
        options.padding = schema.Padding.SAME
        if isinstance(options, schema.DepthwiseConv2DOptionsT):
            options.depthMultiplier = 1
        self.inputs.append(given)
        return self.step(KINDS[depthwise], [given, weight, bias], result, options)

    def whole(self, layer: torch.nn.Conv2d, random: np.random.Generator) -> None:
        """A layer of whole numbers, one step for all of them, which `layer` then has."""
        outputs = layer.weight.shape[0]
        steps = random.integers(0, 256, layer.weight.shape).astype(np.uint8)
        bias = random.integers(-999, 999, outputs).astype(np.int32)
        scale, zero = float(np.float32(random.uniform(0.01, 0.1))), int(random.integers(100, 150))
        kernel = as_stored(steps, layer)
        given = self.tensor([1, 4, 4, layer.in_channels], UINT8, [1 / 128], [128])
        weight = self.tensor(kernel.shape, UINT8, [scale], [zero], kernel)
        added = self.tensor([outputs], INT32, [scale / 128], [0], bias)
        self.outputs.append(
            self.convolved(layer, given, weight, added, self.tensor([1, 4, 4, outputs], UINT8, [1.0], [0]))
        )
        fill(
            layer,
            (steps.astype(np.float64) - zero) * np.float32(scale),
            bias * np.float64(np.float32(scale / 128)),
        )

    def mixed(self, layer: torch.nn.Conv2d, random: np.random.Generator) -> None:
        """A layer of floats; a depthwise one has whole numbers, a step for each channel, unpacked before it,
        and a batch norm behind it."""
        outputs = layer.weight.shape[0]
        given = self.tensor([1, 4, 4, layer.in_channels], FLOAT)
        result = self.tensor([1, 4, 4, outputs], FLOAT)
        bias = random.normal(size=outputs).astype(np.float32)
        added = self.tensor([outputs], FLOAT, data=bias)
        if layer.groups == 1:
            weights = random.normal(size=layer.weight.shape).astype(np.float32)
            kernel = as_stored(weights, layer)
            weight = self.tensor(kernel.shape, FLOAT, data=kernel)
            self.outputs.append(self.convolved(layer, given, weight, added, result))
            fill(layer, weights, bias)
            return
        steps = random.integers(-127, 128, layer.weight.shape).astype(np.int8)
        scales = random.uniform(0.01, 0.1, outputs).astype(np.float32)
        kernel = as_stored(steps, layer)
        packed = self.tensor(kernel.shape, INT8, scales.tolist(), [0] * outputs, kernel, along=3)
        weight = self.step(
            "DEQUANTIZE", [packed], self.tensor(kernel.shape, FLOAT), schema.DequantizeOptionsT()
        )
        self.convolved(layer, given, weight, added, result)
        factors, more = random.normal(size=(2, outputs)).astype(np.float32)
        scaled, moved = (self.tensor([1, 4, 4, outputs], FLOAT) for _ in range(2))
        of_channels = [self.tensor([outputs], FLOAT, data=values) for values in (factors, more)]
        self.step("MUL", [result, of_channels[0]], scaled, schema.MulOptionsT())
        self.outputs.append(self.step("ADD", [scaled, of_channels[1]], moved, schema.AddOptionsT()))
        exact = steps.astype(np.float64) * scales.astype(np.float64)[:, None, None, None]
        fill(
            layer,
            exact * factors.astype(np.float64)[:, None, None, None],
            bias.astype(np.float64) * factors + more.astype(np.float64),
        )

    def write(self, path) -> None:
        codes = []
        for kind in KINDS:
            code = schema.OperatorCodeT()
            code.builtinCode = code.deprecatedBuiltinCode = getattr(schema.BuiltinOperator, kind)
            codes.append(code)
        graph = schema.SubGraphT()
        graph.tensors, graph.operators = self.tensors, self.steps
        graph.inputs, graph.outputs = self.inputs, self.outputs
        model = schema.ModelT()
        model.version, model.operatorCodes, model.subgraphs, model.buffers = 3, codes, [graph], self.buffers
        builder = flatbuffers.Builder(1 << 22)
        builder.Finish(model.Pack(builder), b"TFL3")
        path.write_bytes(bytes(builder.Output()))


def as_stored(values: np.ndarray, layer: torch.nn.Conv2d) -> np.ndarray:
    return values.transpose(1, 2, 3, 0) if layer.groups > 1 else values.transpose(0, 2, 3, 1)


def fill(layer: torch.nn.Conv2d, weights: np.ndarray, bias: np.ndarray) -> None:
    assert layer.bias is not None
    with torch.no_grad():
        layer.weight.copy_(torch.from_numpy(weights))
        layer.bias.copy_(torch.from_numpy(bias))


def written(
    path,
    network: torch.nn.Module,
    *,
    whole: bool,
    leave: str = "",
    more: bool = False,
    last: torch.nn.Conv2d | None = None,
):
    """A file of random weights, which the network then has; layers whose names begin with `leave` are not in
    it; more: with one in its midst that the network has not; last: a layer behind it."""
    writer, random = Writer(), np.random.default_rng(0)
    put = writer.whole if whole else writer.mixed
    for name, layer in network.named_modules():
        if isinstance(layer, torch.nn.Conv2d) and not (leave and name.startswith(leave)):
            put(layer, random)
        if more and name == "deep":
            put(torch.nn.Conv2d(64, 33, 1), random)
    if last is not None:
        put(last, random)
    writer.write(path)
    return network


@pytest.fixture
def files(tmp_path):
    """DeepLab as floats with batch norms, MOSAIC in whole numbers: as they are published."""
    eyes = OtherEyes()
    written(tmp_path / "deeplab.tflite", eyes.deeplab, whole=False)
    written(tmp_path / "mosaic.tflite", eyes.mosaic, whole=True, more=True)
    return eyes, tmp_path / "deeplab.tflite", tmp_path / "mosaic.tflite"


def test_weights_are_found_in_the_order_of_layers(files):
    eyes, *paths = files
    found = read_others(*paths)
    own = eyes.state_dict()
    assert found.keys() == own.keys()
    for name, value in own.items():
        assert torch.equal(found[name], value), name


def test_scores_of_names_are_found(files, tmp_path):
    """Scores of what the file's own network gives are those of our maps, which are divided by `LARGE`."""
    layer = torch.nn.Conv2d(CHANNELS, len(NAMES), 1)
    written(tmp_path / "scores.tflite", DeepLab(), whole=False, last=layer)
    weight, bias = read_scores(tmp_path / "scores.tflite")
    torch.testing.assert_close(weight / LARGE, layer.weight[:, :, 0, 0], rtol=3e-7, atol=0)  # rounded twice
    assert layer.bias is not None and torch.equal(bias, layer.bias)
    assert len(set(NAMES)) == len(NAMES) == 151 and NAMES[1] == "wall" and NAMES[150] == "flag"
    with pytest.raises(InputError, match="does not score the 150 names of ADE20K"):
        read_scores(files[1])


def test_another_network_is_refused(files, tmp_path):
    _, deeplab, mosaic = files
    with pytest.raises(InputError, match=r"not the DeepLab .*no layer .*NOTICE"):
        read_others(mosaic, deeplab)
    written(tmp_path / "net.tflite", DeepLab(), whole=False, leave="blocks.9.depthwise")
    with pytest.raises(InputError, match=r"not the DeepLab "):
        read_others(tmp_path / "net.tflite", mosaic)
    written(tmp_path / "net.tflite", Mosaic(), whole=True, leave="both")
    with pytest.raises(InputError, match=r"not the Mosaic .*no layer both"):
        read_others(deeplab, tmp_path / "net.tflite")


def test_what_is_no_network_is_refused(tmp_path):
    (tmp_path / "no.tflite").write_bytes(b"no network")
    with pytest.raises(InputError, match="no TensorFlow Lite network"):
        read_others(tmp_path / "no.tflite", tmp_path / "no.tflite")
