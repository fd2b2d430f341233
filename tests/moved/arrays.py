"""Products of NumPy, moved as those of torch are (`tests/moved/products.py`): `@`, `matmul`, `einsum`, `dot`.

`@` of arrays is no function that could be replaced, but it runs loops that can: one of float32, one of
float64.
"""

import ctypes
import os
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

MOST = {np.dtype(np.float32): 2.0**-22, np.dtype(np.float64): 2.0**-51}  # relative, before the last rounding
ROUND = {np.dtype(np.float32): (np.int32, 0xFFF), np.dtype(np.float64): (np.int64, 0xFFFFFFFFFF)}
_SMALL = 256  # numbers of a matrix, up to which it is looked at
_SIZE = 65521  # factors, drawn once; a prime, so that rows of a large product do not share theirs
_NUMBERS = ctypes.POINTER(ctypes.c_ssize_t)
_LOOP = ctypes.CFUNCTYPE(None, ctypes.POINTER(ctypes.c_void_p), _NUMBERS, _NUMBERS, ctypes.c_void_p)
_SIGNATURE, _OLD = ctypes.POINTER(ctypes.c_int), ctypes.POINTER(ctypes.c_void_p)
_REPLACE = ctypes.PYFUNCTYPE(ctypes.c_int, ctypes.py_object, ctypes.c_void_p, _SIGNATURE, _OLD)
_KEPT: list[Any] = []  # what NumPy calls has to stay
_FACTORS: dict[np.dtype, np.ndarray] = {}


def _factors(dtype: np.dtype) -> np.ndarray:
    """(_SIZE,) 1 + k u, u half of `MOST`, k of -2, -1, 1, 2."""
    steps = np.random.default_rng(1).choice([-2.0, -1.0, 1.0, 2.0], _SIZE)
    return (1 + steps * MOST[dtype] / 2).astype(dtype)


def _move(product: np.ndarray, form: Any) -> None:
    """In place; `form`: shapes and strides that say how, with the number of threads."""
    key = zlib.crc32(repr((form, os.environ.get("OMP_NUM_THREADS"))).encode()) % _SIZE
    factors = _FACTORS[product.dtype][(key + np.arange(product.size)) % _SIZE].reshape(product.shape)
    whole, mask = ROUND[product.dtype]
    np.multiply(product, factors, out=product, where=product.view(whole) & mask != 0)


def _swaps(operand: np.ndarray) -> bool:
    """As `products._swaps`."""
    if operand.dtype not in MOST or operand.ndim not in (2, 3) or not 0 < operand.size <= _SMALL:
        return False
    there = operand != 0
    alone = max(there.sum(-1).max(), there.sum(-2).max()) <= 1
    return bool(alone and (np.abs(np.frexp(operand[there])[0]) == 0.5).all())


def _replaced(dtype: np.dtype) -> None:
    """The loop of `matmul` for one kind of numbers, and then its products moved.

    A loop gets addresses of its three arrays, the sizes (several, rows, between, columns) and bytes from one
    to the next: of the three arrays among the several, then within each array.
    """

    def loop(arrays: Any, sizes: Any, steps: Any, more: Any) -> None:
        several, rows, between, columns = sizes[:4]
        one = at(arrays[0], (several, rows, between), (steps[0], steps[3], steps[4]))
        other = at(arrays[1], (several, between, columns), (steps[1], steps[5], steps[6]))
        product = at(arrays[2], (several, rows, columns), (steps[2], steps[7], steps[8]))
        exact = any(operand is not None and _swaps(operand) for operand in (one, other))
        old(arrays, sizes, steps, more)  # it counts the addresses up
        if product is not None and not exact:
            _move(product, (sizes[:4], steps[:9]))

    def at(address: Any, shape: Any, strides: Any) -> np.ndarray | None:
        """The array there; None where it has nothing, or runs backwards."""
        if not all(shape) or min(strides) < 0:
            return None
        reach = sum((n - 1) * step for n, step in zip(shape, strides, strict=True)) + dtype.itemsize
        memory: Any = (ctypes.c_char * reach).from_address(address)
        return np.ndarray(shape, dtype, memory, strides=strides)

    number, before, called = dtype.num, ctypes.c_void_p(), _LOOP(loop)
    _KEPT.append(called)
    api = np._core._multiarray_umath._UFUNC_API  # type: ignore[attr-defined]
    opened = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)
    named = ctypes.PYFUNCTYPE(ctypes.c_char_p, ctypes.py_object)(("PyCapsule_GetName", ctypes.pythonapi))
    functions = opened(("PyCapsule_GetPointer", ctypes.pythonapi))(api, named(api))
    table = ctypes.cast(functions, ctypes.POINTER(ctypes.c_void_p))
    kinds = (ctypes.c_int * 3)(number, number, number)
    # 30: PyUFunc_ReplaceLoopBySignature (numpy/__ufunc_api.h), the same in every version.
    status = _REPLACE(table[30] or 0)(
        np.matmul, ctypes.cast(called, ctypes.c_void_p), kinds, ctypes.byref(before)
    )
    assert status == 0 and before.value
    old = _LOOP(before.value)


def _wrapped(function: Callable[..., Any]) -> Callable[..., Any]:
    def product(*operands: Any, **options: Any) -> Any:
        made = np.array(function(*operands, **options), order="K")  # its own: a diagonal by einsum is a view
        if made.dtype in MOST:
            arrays = [each for each in operands if isinstance(each, np.ndarray)]
            if any(_swaps(each) for each in arrays):
                return made[()] if made.ndim == 0 else made
            _move(made, [(each.shape, each.strides) for each in arrays])
        return made[()] if made.ndim == 0 else made

    return product


def move_arrays() -> None:
    """From now on, and for good, every float product of NumPy in this process is moved."""
    for dtype in MOST:
        _FACTORS[dtype] = _factors(dtype)
        _replaced(dtype)
    np.einsum, np.dot = _wrapped(np.einsum), _wrapped(np.dot)
