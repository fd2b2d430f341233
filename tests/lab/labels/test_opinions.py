"""What another network says of photos: values of its scores, a folder gone on with, a real network."""

import flatbuffers
import numpy as np
import pytest
from ai_edge_litert import schema_py_generated as schema

from langflash_core.errors import InputError
from langflash_core.lab.labels.opinions import LEVELS, SURER, LiteNetwork, opinion_of, write_opinions
from langflash_core.lab.photos import open_folder
from langflash_core.lab.photos.writing import FolderWriter

RED, BLUE = (200, 30, 20), (10, 40, 220)


class Eye:
    """Scores red as name 3 and blue as name 5 with a margin, at half the size; counts how often it looks."""

    def __init__(self, margin: float, slip: float = 0.0):
        self.margin, self.slip, self.looks = margin, slip, 0

    def scores(self, image):
        self.looks += 1
        small = image[::2, ::2].astype(np.float32)
        found = np.zeros((*small.shape[:2], 32), np.float32)
        found[..., 3] = self.margin * (small[..., 0] > 100)
        found[..., 5] = self.margin * (small[..., 2] > 100)
        found[:, 0, 7] = self.slip  # wrong at the left of whatever it sees
        return found


def picture(height: int, width: int) -> np.ndarray:
    pixels = np.empty((height, width, 3), np.uint8)
    pixels[:, : width // 2], pixels[:, width // 2 :] = RED, BLUE
    return pixels


@pytest.mark.parametrize("margin", [1.0, 3.0, 5.0, 9.0])
def test_a_value_is_the_name_and_how_sure_it_is(margin):
    said = opinion_of(picture(8, 12), Eye(margin))
    sure = np.exp(margin) / (np.exp(margin) + 31)
    level = sum(sure >= edge for edge in SURER)
    assert said.shape == (4, 6) and said.dtype == np.uint8
    assert (said[:, :3] == LEVELS * 3 + level).all() and (said[:, 3:] == LEVELS * 5 + level).all()


def test_what_only_one_of_two_looks_says_counts_half():
    """A slip at the left edge of whatever is seen is one of two opinions there."""
    never, once, surely = (opinion_of(picture(4, 8), Eye(9.0, slip)) // LEVELS for slip in (0.0, 14.0, 40.0))
    assert (once == never).all() and (surely[:, 0] == 7).all()


def test_a_folder_is_gone_on_with(tmp_path):
    writer = FolderWriter(tmp_path)
    for id in ("1", "2", "3"):
        writer.photo(id, picture(216, 240))
    writer.finish({}, "drawn by a test")
    eye = Eye(5.0)
    assert write_opinions(open_folder(tmp_path), ("1",), eye) == 1
    assert write_opinions(open_folder(tmp_path), ("1", "2", "3"), eye) == 2
    assert eye.looks == 6, "a look and a mirrored one a photo, once"
    folder = open_folder(tmp_path)
    said = folder.opinions("3", (216, 240))
    assert said is not None and np.array_equal(said[::2, ::2], opinion_of(picture(216, 240), eye))
    own = folder.photo("3").opinions
    assert own is not None and np.array_equal(own, said)
    (tmp_path / "opinions" / "3.png").unlink()
    assert folder.photo("3").opinions is None


def lite(path, dtype=schema.TensorType.UINT8, names: int = 4) -> None:
    """A network of one convolution: a name's score is a channel of every fourth pixel, of 16 x 16."""

    def tensor(name, shape, type, buffer, scale, zero):
        one = schema.TensorT()
        one.name, one.shape, one.type, one.buffer = name, shape, type, buffer
        one.quantization = schema.QuantizationParametersT()
        one.quantization.scale, one.quantization.zeroPoint = [scale], [zero]
        return one

    kernel = np.full((names, 1, 1, 3), 128, np.uint8)  # 0 at its zero point
    for name in range(min(names, 3)):
        kernel[name, 0, 0, name] = 138
    buffers = [schema.BufferT() for _ in range(3)]
    buffers[1].data = kernel.ravel()  # pyright: ignore[reportAttributeAccessIssue] - its stubs know None
    buffers[2].data = np.zeros(names, np.int32).view(np.uint8)  # pyright: ignore[reportAttributeAccessIssue]
    convolve, code = schema.Conv2DOptionsT(), schema.OperatorCodeT()
    convolve.strideH = convolve.strideW = 4
    convolve.padding, convolve.dilationHFactor, convolve.dilationWFactor = schema.Padding.VALID, 1, 1
    code.builtinCode = code.deprecatedBuiltinCode = schema.BuiltinOperator.CONV_2D
    step = schema.OperatorT()
    step.opcodeIndex, step.inputs, step.outputs = 0, [0, 1, 2], [3]
    step.builtinOptionsType, step.builtinOptions = schema.BuiltinOptions.Conv2DOptions, convolve
    graph = schema.SubGraphT()
    graph.tensors = [
        tensor("photo", [1, 16, 16, 3], dtype, 0, 1 / 128, 128),
        tensor("weights", list(kernel.shape), dtype, 1, 0.1, 128),
        tensor("bias", [names], schema.TensorType.INT32, 2, 0.1 / 128, 0),
        tensor("logits/BiasAdd", [1, 4, 4, names], dtype, 0, 0.01, 128),
    ]
    graph.inputs, graph.outputs, graph.operators = [0], [3], [step]
    model = schema.ModelT()
    model.version, model.operatorCodes, model.subgraphs, model.buffers = 3, [code], [graph], buffers
    builder = flatbuffers.Builder(1024)
    builder.Finish(model.Pack(builder), b"TFL3")
    path.write_bytes(bytes(builder.Output()))


def test_a_network_of_tensorflow_lite_is_asked(tmp_path):
    lite(tmp_path / "net.tflite")
    network = LiteNetwork(tmp_path / "net.tflite")
    scores = network.scores(picture(8, 16))
    assert scores.shape == (2, 4, 4), "what is left of the square is no part of the photo"
    for columns, colour in ((slice(0, 2), RED), (slice(2, 4), BLUE)):
        expected = [(value - 128) / 128 for value in colour]
        # Half a step of the scores, .01, and of pixels between colours none: columns lie inside them.
        assert np.abs(scores[:, columns, :3] - expected).max() <= 0.0051
        assert np.abs(scores[:, columns, 3]).max() <= 0.0051
    assert (opinion_of(picture(8, 16), network) // LEVELS)[:, 3].tolist() == [2, 2]


def test_what_is_no_such_network_is_refused(tmp_path):
    (tmp_path / "no.tflite").write_bytes(b"no network")
    with pytest.raises(InputError, match="no TensorFlow Lite network"):
        LiteNetwork(tmp_path / "no.tflite")
    lite(tmp_path / "many.tflite", names=40)
    with pytest.raises(InputError, match="at most 32 names"):
        LiteNetwork(tmp_path / "many.tflite")
