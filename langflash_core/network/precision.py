"""Where bfloat16 is quick: graphics cards, and processors with instructions for it."""

import torch

_INSTRUCTIONS = ("amx_bf16", "avx512_bf16", "bf16", "sve_bf16")


def mixed_precision(device: str | torch.device) -> torch.autocast:
    """A context in which matrix products run in bfloat16 where that is quicker, else as they are.

    On a processor without such instructions bfloat16 is emulated: the encoder took two to five
    times as long as in float32 there (AVX2), and about a third of the time where they are (AMX).
    """
    kind = torch.device(device).type
    return torch.autocast(kind, dtype=torch.bfloat16, enabled=kind != "cpu" or has_bfloat16())


def has_bfloat16() -> bool:
    """Whether this processor has instructions for bfloat16 that torch can use."""
    known = torch.cpu.get_capabilities()
    return any(bool(known.get(name)) for name in _INSTRUCTIONS) and not bfloat16_fails()


def bfloat16_fails() -> bool:
    """Whether attention in bfloat16 stops with an error: the processor has AMX, which torch 2.13 asks for
    there, but ATEN_CPU_CAPABILITY told torch to leave out the vector units that go with it."""
    hidden = torch.backends.cpu.get_cpu_capability() in ("DEFAULT", "AVX2")
    return hidden and bool(torch.cpu.get_capabilities().get("amx_bf16"))
