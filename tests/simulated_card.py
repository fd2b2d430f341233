"""A graphics card made of the processor: tensors that say they lie on the device `card`, and a count of what
crosses between it and the processor, place by place.

    python -m tests.simulated_card OUT.json PHOTO...

Every operation is the processor's, but like a card's tensors these refuse numpy and operands that lie
elsewhere. The device is registered with torch for good, so whoever wants it starts a process.

OUT.json: `down` and `read`, how often a tensor or one number came from the card, `up` what went onto it, each
by module and function of the library. And of the scenes that were made on the processor, `cpu`, on the
card, and on one without float64, `single`, poses and how many Gaussians.
"""

import argparse
import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import torch
from torch import Tensor
from torch.utils._pytree import tree_leaves, tree_map
from torch.utils.backend_registration import _setup_privateuseone_for_python_backend

_setup_privateuseone_for_python_backend("card")
_CARD, _ATEN = torch.device("card:0"), torch.ops.aten
_MIXED = (_ATEN.index.Tensor, _ATEN.index_put_.default, _ATEN._index_put_impl_.default, _ATEN.copy_.default)
"""What takes operands of both: indices may come from the processor."""
_MADE = (
    "empty.memory_format", "empty_strided", "full", "zeros", "ones", "eye", "eye.m", "linspace",
    "arange", "arange.start", "arange.start_step", "copy_", "view", "zero_", "fill_.Scalar",
    "_local_scalar_dense",
)  # fmt: skip
"""Of tensors that torch makes beneath the class: what they are made and filled by."""
_CORE = "langflash_core"

crossings: dict[str, Counter[str]] = {kind: Counter() for kind in ("down", "read", "up")}
without_doubles = False


class OnCard(Tensor):
    """A tensor of the processor that says it lies on the card."""

    @staticmethod
    def __new__(cls, held: Tensor) -> "OnCard":
        return Tensor._make_wrapper_subclass(
            cls, held.size(), strides=held.stride(), storage_offset=held.storage_offset(), dtype=held.dtype,
            device=_CARD, requires_grad=held.requires_grad,
        )  # fmt: skip

    def __init__(self, held: Tensor):
        self.held = held

    def tolist(self) -> Any:
        return self.cpu().tolist()

    @classmethod
    def __torch_dispatch__(cls, func: Any, types: Any, args: tuple = (), kwargs: dict | None = None) -> Any:
        return _run(func, args, kwargs or {})


def _run(func: Any, args: tuple, kwargs: dict) -> Any:
    """One operation, on the processor; its answer lies where the card would leave it."""
    operands = [value for value in tree_leaves((args, kwargs)) if isinstance(value, Tensor)]
    ours = [value for value in operands if isinstance(value, OnCard)]
    elsewhere = [value for value in operands if not isinstance(value, OnCard) and value.dim() > 0]
    if ours and elsewhere and func not in _MIXED:
        raise RuntimeError(f"{func}: operands lie on two devices")
    device = kwargs.get("device")
    to_card = bool(ours) if device is None else torch.device(device).type == _CARD.type
    _count(func, args, bool(ours), to_card)
    if func is _ATEN._scaled_dot_product_fused_attention_overrideable.default:
        func = _ATEN._scaled_dot_product_flash_attention_for_cpu.default
    placed = kwargs if device is None else {**kwargs, "device": torch.device("cpu")}
    found = func(*tree_map(_held, args), **tree_map(_held, placed))
    if func._schema.name.endswith("_") and not func._schema.name.endswith("__"):
        return args[0]  # it was changed in place
    if "out" in kwargs:
        return kwargs["out"]
    return tree_map(_wrapped, found) if to_card else found


def _held(value: Any) -> Any:
    return value.held if isinstance(value, OnCard) else value


def _wrapped(value: Any) -> Any:
    if not isinstance(value, Tensor):
        return value
    if without_doubles and value.dtype == torch.float64:
        raise TypeError("this card has no float64")
    return OnCard(value)


def _count(func: Any, args: tuple, ours: bool, to_card: bool) -> None:
    if func is _ATEN.copy_.default and isinstance(args[0], OnCard) != isinstance(args[1], OnCard):
        crossings["up" if isinstance(args[0], OnCard) else "down"][_place()] += 1
    elif func is _ATEN._to_copy.default and ours != to_card:
        crossings["up" if to_card else "down"][_place()] += 1
    elif func in (_ATEN._local_scalar_dense.default, _ATEN.equal.default) and ours:
        crossings["read"][_place()] += 1


def _place() -> str:
    """Module and function of the library that asked for it."""
    frame = sys._getframe(1)
    while frame is not None and f"/{_CORE}/" not in frame.f_code.co_filename:
        frame = frame.f_back
    if frame is None:
        return "elsewhere"
    return f"{frame.f_code.co_filename.rpartition(f'/{_CORE}/')[2]} {frame.f_code.co_name}"


def _register() -> torch.library.Library:
    library = torch.library.Library("aten", "IMPL")
    for name in _MADE:
        packet, _, overload = name.partition(".")
        func = getattr(getattr(_ATEN, packet), overload or "default")
        takes_device = any(argument.name == "device" for argument in func._schema.arguments)

        def kernel(*args: Any, func: Any = func, takes_device: bool = takes_device, **kwargs: Any) -> Any:
            return _run(func, args, {"device": _CARD, **kwargs} if takes_device else kwargs)

        library.impl(name, kernel, "PrivateUse1")
    return library


def main() -> None:
    """Scenes of the same photos, made on both devices, and what crossed."""
    global without_doubles
    parser = argparse.ArgumentParser()
    parser.add_argument("out", type=Path)
    parser.add_argument("photos", type=Path, nargs="+")
    args = parser.parse_args()
    from langflash_core.depth import planes
    from langflash_core.network.model import LangFlashNet
    from langflash_core.pipeline import reconstruct
    from langflash_core.reconstruction import options

    # Views of parameters cannot be wrapped in inference mode.
    LangFlashNet.predict = torch.no_grad()(LangFlashNet.predict.__wrapped__)
    options.chosen_device = lambda name: name

    def scene(device: str) -> dict:
        made = reconstruct(args.photos, device=device, precision="float32", size=112)
        return {"poses": made.viewmats.tolist(), "gaussians": len(made.gaussians)}

    found = {device: scene(device) for device in ("cpu", _CARD.type)}
    found |= {kind: dict(places) for kind, places in crossings.items()}
    planes.WITHOUT_DOUBLES, without_doubles = (_CARD.type,), True
    args.out.write_text(json.dumps({**found, "single": scene(_CARD.type)}, indent=1), encoding="utf-8")


_LIBRARY = _register()
if __name__ == "__main__":
    main()
