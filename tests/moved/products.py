"""Products as another processor would round them: for a pass of the tests that must not hang on last bits.

A processor may take another way through a product of another shape: other lanes, other blocks, other orders
of the sums. Here every float product of torch on the processor, forwards and backwards, on any thread, is
moved after it was computed: each number by one or two parts in 2^23 (float32) or 2^52 (float64). How, hangs
on the shapes and strides of its operands and on the number of threads alone: the same product is the same
bits all through a run, and one of another shape is not. Integers, half floats and round numbers (the lowest
12 bits of float32 or 40 of float64 are 0) stay as they are, and so does what is a product with a matrix that
swaps axes, turns them about or doubles them: such sums are exact on every processor. `LANGFLASH_MOVED=1`
turns it on, in processes that tests start, too (`tests/moved/sitecustomize.py`).
"""

import warnings
import zlib
from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor

# What all others are made of; `mv`, `linear`, `matmul`, `einsum` and `cdist` call these.
OPERATORS = (
    *("mm", "mm.out", "bmm", "bmm.out", "dot", "vdot"),
    *("addmm", "addmm.out", "addmm_", "baddbmm", "baddbmm.out", "baddbmm_", "addmv", "addmv.out", "addmv_"),
    *(
        "_addmm_activation",
        "convolution",
        "convolution_backward",
        "_scaled_dot_product_flash_attention_for_cpu",
    ),
)
MOST = {torch.float32: 2.0**-22, torch.float64: 2.0**-51}  # relative, before the last rounding
ROUND = {torch.float32: (torch.int32, 0xFFF), torch.float64: (torch.int64, 0xFFFFFFFFFF)}  # bits of 0
_SMALL = 256  # numbers of a matrix, up to which it is looked at
_SIZE = 65521  # factors, drawn once; a prime, so that rows of a large product do not share theirs


def _factors(dtype: torch.dtype) -> Tensor:
    """(2 _SIZE,) 1 + k u, u half of `MOST`, k of -2, -1, 1, 2; its second half is its first."""
    drawn = torch.randint(0, 4, (_SIZE,), generator=torch.Generator().manual_seed(1))
    steps = torch.tensor([-2.0, -1.0, 1.0, 2.0], dtype=torch.float64)[drawn]
    return (1 + steps * MOST[dtype] / 2).to(dtype).repeat(2)


def _swaps(operand: Any) -> bool:
    """Whether it is a small matrix, or several, with at most one number in each row and each column, a power
    of two: every product with it is exact."""
    if not isinstance(operand, Tensor) or operand.dtype not in MOST or operand.ndim not in (2, 3):
        return False
    if not 0 < operand.numel() <= _SMALL:
        return False
    there = operand != 0
    alone = max(int(there.sum(-1).max()), int(there.sum(-2).max())) <= 1
    return alone and bool((operand[there].frexp().mantissa.abs() == 0.5).all())


def _key(name: str, operands: tuple) -> int:
    """Where in the factors a product begins: of its shapes, strides and the number of threads."""
    forms = [(*each.shape, *each.stride()) for each in operands if isinstance(each, Tensor)]
    return zlib.crc32(repr((name, torch.get_num_threads(), forms)).encode()) % _SIZE


def _move(product: Tensor, factors: Tensor, key: int) -> None:
    """Multiply in place, in the order of memory where the product fills it, else in its own."""
    whole, mask = ROUND[product.dtype]
    dense = torch.ops.aten.is_non_overlapping_and_dense(product)
    flat = product.as_strided((product.numel(),), (1,)) if dense else product.flatten()
    for start in range(0, flat.numel(), _SIZE):
        part = flat[start : start + _SIZE]
        rough = part.view(whole).bitwise_and(mask).bool()
        torch.where(rough, part * factors[key : key + part.numel()], part, out=part)
    if not dense:
        product.copy_(flat.view_as(product))


def move_products() -> None:
    """From now on, and for good, every float product of this process is moved."""
    factors = {dtype: _factors(dtype) for dtype in MOST}

    def moved(name: str, kernel: Any) -> Callable[..., Any]:
        def product(keys: Any, *operands: Any, **options: Any) -> Any:
            exact = any(_swaps(operand) for operand in operands)
            made = kernel.call_boxed(keys, *operands, **options)
            if exact:
                return made
            for each in made if isinstance(made, tuple) else (made,):
                if isinstance(each, Tensor) and each.dtype in factors and each.numel():
                    _move(each, factors[each.dtype], _key(name, operands))
            return made

        return product

    global _library
    _library = torch.library.Library("aten", "IMPL")  # what it says holds as long as it is there
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that a kernel is replaced
        for name in OPERATORS:
            _library.impl(
                name, moved(name, torch.library.get_kernel(f"aten::{name}", "CPU")), "CPU", with_keyset=True
            )


_library: torch.library.Library | None = None
