"""The table of outputs, requests, and what is read from them."""

import inspect
import re
from dataclasses import fields, replace
from pathlib import Path

import pytest

from app.cli.commands.export import request_of
from app.cli.parser import build_parser
from langflash_core.base.formats import kind_of
from langflash_core.base.outputs import (
    ALL_OUT,
    BOXES_JSON,
    COCO,
    CUTOUT,
    DEPTH_EXR,
    OFFERED,
    OUTPUTS,
    READERS,
    RGB,
    SEGMENTED,
    WORDS,
    Output,
    help_of_files,
    import_reference,
    output_of,
)
from langflash_core.base.request import ExportRequest
from langflash_core.errors import InputError

GUIDE = (Path(__file__).parents[2] / "GUIDE.md").read_text("utf-8")


@pytest.mark.parametrize("output", OUTPUTS, ids=lambda output: output.name)
def test_every_writer_is_there_and_takes_what_it_gets(output: Output) -> None:
    plain = [output.of_scene, output.of_frame, output.of_answer]
    assert list(inspect.signature(import_reference(output.writer)).parameters) == ["job"]
    assert output.of_scene or output.writer != Output("", ("",)).writer, "nobody writes it"
    for reference in filter(None, plain):
        _, second, *rest = inspect.signature(import_reference(reference)).parameters.values()
        assert second.name == "path" and all(p.default is not p.empty for p in rest), reference


def test_names_are_of_one_kind_each_and_words_never_of_two_for_an_ending() -> None:
    assert len({output.name for output in OUTPUTS}) == len(OUTPUTS)
    said = [(output.word, ending) for output in OUTPUTS for ending in output.endings if output.word]
    assert len(set(said)) == len(said)
    for output in OFFERED:
        assert output.label and output.tip and kind_of(Path(f"x{output.suffix}")) == output.suffix
    assert set(READERS) >= {".ksplat", ".gltf"}
    assert all(callable(import_reference(reader)) for reader in READERS.values())


def test_an_ending_stands_for_one_thing_unless_what_is_said() -> None:
    def of(name: str, what: str | None = None, asked: bool = False) -> Output | None:
        return output_of(Path(name), what, asked)

    assert (of("a.png"), of("a.png", asked=True)) == (RGB, CUTOUT)
    assert (of("a.json"), of("a.json", "boxes"), of("a.EXR", asked=True)) == (COCO, BOXES_JSON, DEPTH_EXR)
    assert of("a.ply", "mask") is None and of("a.foo") is None
    for ending in ALL_OUT:
        name = f"a{ending}" if ending.startswith(".") else ending
        assert of(name) is not None and of(name, asked=True) is not None


def parsed(request: ExportRequest) -> ExportRequest:
    return request_of(build_parser().parse_args(request.words()))


@pytest.mark.parametrize("output", OUTPUTS, ids=lambda output: output.name)
def test_the_command_line_reads_a_request_as_it_was(output: Output) -> None:
    ending = output.suffix
    said = ExportRequest(
        Path(f"a{ending}" if ending.startswith(".") or not ending else ending),
        Path("my room.langflash"),
        what=output.word or None,
        segmented=output is SEGMENTED,
        prompts=("an armchair",) if output.needs_phrases else (),
        size=(640, 480) if output.sized else None,
        span=(-0.25, 0.9) if output.colours else None,
        colormap="viridis" if output.colours else "heat",
        seconds=2.5 if output.moves else None,
        detail="low" if output.splats else "all",
        replace=True,
    )
    assert said.check() is output and parsed(said) == said
    turned = replace(said, scene=Path("a.spz"), axes="rdf")
    assert turned.check() is output and parsed(turned) == turned
    if output.looks:
        posed = replace(said, camera=Path("c.json"), ortho=True, fade=True, backend="torch")
        assert posed.check() is output and parsed(posed) == posed


def test_every_field_of_a_request_is_an_option() -> None:
    said = build_parser().parse_args(["export", "s.langflash", "-o", "a.png"])
    missing = {field.name for field in fields(ExportRequest)} - vars(said).keys()
    assert missing == {"prompts"}, "which the command line calls --prompt"


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"threshold": 0.5}, "--threshold needs a phrase"),
        ({"what": "mask"}, "--what mask needs a phrase"),
        ({"output": Path("a.csv")}, "a .csv of boxes needs a phrase"),
        ({"output": Path("a.exr"), "prompts": ("plant",)}, "an .exr of depth takes no --prompt"),
        ({"output": Path("a.ply"), "what": "depth"}, "takes a .png or .exr"),
        ({"what": "heat", "prompts": ("a", "b")}, "draws one phrase"),
        ({"seconds": 2.0}, "--seconds is for videos"),
        ({"span": (0.1, 0.2)}, "colour heat-maps"),
        ({"with_text": True}, "for web pages"),
        ({"detail": "low"}, "for splats"),
        ({"output": Path("a.ply"), "axes": "rdf"}, "--axes is for .spz files"),
        ({"fill": True, "prompts": ("plant",)}, "--fill is for"),
        ({"all_views": True, "view": 0}, "leave --view out"),
        ({"output": Path("a.ply"), "size": (2, 2)}, "holds what all views show"),
        ({"output": Path("a.ply"), "fade": True}, "only views fade"),
        ({"output": Path("a.mp4"), "view": 1}, "moves by itself"),
        ({"segmented": True}, "--segmented needs phrases"),
        ({"segmented": True, "prompts": ("plant",), "all_views": True}, "by itself"),
    ],
)
def test_words_that_do_not_go_together_are_refused(changes: dict, sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        replace(ExportRequest(Path("a.png"), Path("s.langflash")), **changes).check()


def test_the_guide_s_table_of_export_and_the_help_name_what_is_written() -> None:
    section = GUIDE.split("| `export` to | writes |")[1].split("\n\n")[0]
    rows = [line.split("|") for line in section.splitlines() if line.startswith("| ")]
    named = {word for row in rows for word in re.findall(r"`([.\w]+)`", row[1]) if "." in word}
    assert named <= set(ALL_OUT) and set(ALL_OUT) - named <= {".usda", ".usdc", ".usdz", "meta.json"}
    told = " ".join(row[2] for row in rows)
    assert {word for word in WORDS if f"`{word}`" not in told and f"`--what {word}`" not in told} <= {
        "rgb",
        "plan",
        "cutout",
    }
    assert all(re.search(rf"(^|[ ;]){re.escape(ending)}[,:]", help_of_files()) for ending in ALL_OUT)
