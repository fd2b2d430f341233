"""Which device is meant, and what crosses between it and the processor on the way from photos to a scene."""

import json
import os
import subprocess
import sys

import pytest
import torch

from langflash_core.base.devices import DEVICES, chosen_device, let_processor_help
from langflash_core.base.resources import asset_path
from langflash_core.errors import InputError
from langflash_core.reconstruction.finding import with_help
from langflash_core.reconstruction.tools import _bfloat16
from langflash_core.types import Prediction

PAIR = [asset_path(f"photos/living_room_{side}.png") for side in ("left", "right")]
POSES = 1e-5
"""Between the devices, absolute: attention adds in another order."""


@pytest.fixture(scope="module")
def crossed(tmp_path_factory) -> dict:
    """What `tests.simulated_card` finds out of two photos."""
    out = tmp_path_factory.mktemp("card") / "crossed.json"
    command = (sys.executable, "-m", "tests.simulated_card", str(out), *map(str, PAIR))
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(out.read_text())


def test_little_leaves_the_card_between_photos_and_scene(crossed: dict):
    """All but the prediction itself, `finding.py`, is what OpenCV and scipy read, and single numbers."""
    assert crossed["down"] == {
        "cameras/structure.py _pose_inputs": 3,
        "cameras/structure.py placed_rig": 2,
        "depth/surfaces.py _beside": 6,  # plane sweep and registration
        "network/guided.py _geometry": 1,
        "network/semantics/splitting.py cluster": 1,
        "reconstruction/finding.py <dictcomp>": 5,
    }
    assert crossed["read"] == {
        "network/semantics/naming.py upright": 1,
        "network/semantics/naming.py places": 1,
        "network/semantics/second.py silent": 1,
    }
    assert sum(crossed["up"].values()) - crossed["up"]["network/checkpoints/files.py load_network"] <= 42


@pytest.mark.parametrize("device", ["card", "single"])
def test_every_device_makes_the_same_scene(device: str, crossed: dict):
    """One with float64 and one without."""
    poses = [torch.tensor(crossed[where]["poses"]) for where in ("cpu", device)]
    torch.testing.assert_close(*poses, rtol=0, atol=POSES)
    assert crossed[device]["gaussians"] == crossed["cpu"]["gaussians"]


@pytest.mark.parametrize("lacking", [NotImplementedError("no such operator"), TypeError("no float64")])
def test_what_a_card_cannot_do_the_processor_does_and_it_is_said_once(lacking, monkeypatch):
    network, found = torch.nn.Linear(1, 1, device="meta"), Prediction.of_bent((), "minilm", {})
    moved: list[str] = []
    monkeypatch.setattr(network, "to", moved.append)

    def predict() -> Prediction:
        if not moved:
            raise lacking
        assert sys.exc_info()[0] is None, "an error holds what filled the card"
        return found

    (said,) = with_help(predict, network).warnings
    assert said.startswith("the graphics card could not run the network") and moved == ["cpu"]
    assert with_help(predict, network).warnings == ()


def there_are(monkeypatch: pytest.MonkeyPatch, *devices: str) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: "cuda" in devices)
    monkeypatch.setattr(torch.backends.mps, "is_available", lambda: "mps" in devices)


@pytest.mark.parametrize(
    ("devices", "meant"), [(("cuda", "mps"), "cuda"), (("cuda",), "cuda"), (("mps",), "mps"), ((), "cpu")]
)
def test_auto_takes_the_first_card_that_there_is(devices, meant, monkeypatch):
    there_are(monkeypatch, *devices)
    assert chosen_device("auto") == meant
    assert [chosen_device(device) for device in (*devices, "cpu")] == [*devices, "cpu"]


@pytest.mark.parametrize("device", ["cuda", "mps"])
def test_a_card_that_is_not_there_cannot_be_had(device, monkeypatch):
    there_are(monkeypatch)
    with pytest.raises(InputError, match=f"no {device.upper()} device .*--device cpu or auto"):
        chosen_device(device)


def test_an_unknown_device_is_answered_by_those_that_there_are():
    with pytest.raises(InputError, match="'tpu' is unknown; choose auto, cpu, cuda or mps"):
        chosen_device("tpu")
    assert DEVICES == ("auto", "cpu", "cuda", "mps")


def test_precision_by_itself_is_bfloat16_on_cuda_alone():
    assert [_bfloat16("mini", "auto", device) for device in ("cpu", "cuda", "mps")] == [False, True, False]


@pytest.mark.parametrize(("system", "said"), [("darwin", "1"), ("linux", None)])
def test_processors_help_the_cards_of_macs_unless_told_otherwise(system, said, monkeypatch):
    name = "PYTORCH_ENABLE_MPS_FALLBACK"
    monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", system)
    let_processor_help()
    assert os.environ.get(name) == said
    monkeypatch.setenv(name, "0")
    let_processor_help()
    assert os.environ[name] == "0"
