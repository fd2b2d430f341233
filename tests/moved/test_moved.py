"""Moved products (`tests/moved`): the same ones the same bits, others near, and what is exact as it was."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.moved import arrays, products

FOLDER = Path(__file__).parent
HALF = {torch.float32: 2.0**-24, torch.float64: 2.0**-53}  # what one rounding moves, relative

MAKE = """
import json, sys, threading
import numpy as np
import torch
from torch.nn import functional as F

def drawn(*shape, dtype=torch.float32):
    return torch.rand(shape, generator=torch.Generator().manual_seed(len(shape)), dtype=dtype)

def made(dtype):
    a, b, x, w = (drawn(*shape, dtype=dtype) for shape in ((40, 30), (30, 50), (2, 4, 9, 9), (6, 4, 3, 3)))
    w = w.requires_grad_()
    convolved = F.conv2d(x, w)
    convolved.sum().backward()
    q = x.flatten(2)
    n, m = a.numpy(), b.numpy()
    return {
        "mm": a @ b, "rows": a[:7] @ b, "strides": a.T.contiguous().T @ b,
        "mv": a @ b[:, 0], "dot": a[0] @ b[:, 0], "bmm": q @ q.mT,
        "linear": F.linear(a, b.T, b[0]),
        "out": torch.mm(a, b, out=torch.empty_like(a @ b)),
        "convolved": convolved.detach(), "gradient": w.grad, "einsum": torch.einsum("ij,jk->ik", a, b),
        "attention": F.scaled_dot_product_attention(*(q[None],) * 3),
        "addmm": torch.ones(40, 50, dtype=dtype).addmm_(a, b), "array": n @ m, "array rows": n[:7] @ m,
        "arrays": q.numpy() @ q.mT.numpy(), "array dot": n[0] @ m[:, 0],
        "array einsum": np.einsum("ij,jk->ik", n, m), "array out": np.matmul(n, m, out=np.zeros_like(n @ m)),
    }

everything = {}
for dtype in (torch.float32, torch.float64):
    for name, value in made(dtype).items():
        everything[f"{name} {str(dtype)[6:]}"] = np.asarray(value).tolist()
again, told = made(torch.float32), []
thread = threading.Thread(target=lambda: told.append(made(torch.float32)))
thread.start()
thread.join()
everything["same"] = [bool((np.asarray(again[k]) == np.asarray(told[0][k])).all()) for k in again]
everything["same"] += [np.asarray(again[k]).tolist() == everything[f"{k} float32"] for k in again]
whole, eye = torch.arange(12).view(3, 4), torch.eye(4)
everything["exact"] = [
    (whole @ whole.T).tolist(), (whole.float() @ whole.T.float()).tolist(), (0.5 * eye @ eye).tolist(),
    (whole.numpy() @ whole.T.numpy()).tolist(), (drawn(8, 8).bfloat16() @ drawn(8, 8).bfloat16()).tolist(),
]
view = np.arange(9.0).reshape(3, 3) / 7
np.einsum("ii->i", view)
everything["exact"].append(view.tolist())
json.dump(everything, sys.stdout)
"""


@pytest.fixture(scope="module")
def runs() -> dict[bool, dict]:
    """What a process makes without moved products, and with them: they stay moved as long as it runs."""
    made = {}
    for moved in (False, True):
        paths = [str(FOLDER)] * moved + [str(FOLDER.parent.parent)]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"}
        told = subprocess.run([sys.executable, "-c", MAKE], env=environment, capture_output=True, text=True)
        assert (told.returncode, told.stderr) == (0, "")
        made[moved] = json.loads(told.stdout)
    return made


def names(runs: dict[bool, dict]) -> list[str]:
    return [name for name in runs[True] if name not in ("same", "exact")]


def test_every_kind_of_product_is_moved_and_by_no_more_than_stated(runs):
    for name in names(runs):
        kind = torch.float32 if name.endswith("32") else torch.float64
        plain, moved = (np.array(runs[way][name]) for way in (False, True))
        # Moved once, and rounded once more.
        assert (np.abs(moved - plain) <= (products.MOST[kind] + HALF[kind]) * np.abs(plain)).all(), name
        assert (moved != plain).mean() > 0.9, name
    assert dict(zip(("float32", "float64"), arrays.MOST.values(), strict=True)) == {
        str(kind)[6:]: most for kind, most in products.MOST.items()
    }


def test_the_same_product_is_the_same_bits_and_one_of_another_shape_or_stride_is_not(runs):
    assert all(runs[True]["same"]), "again, and on another thread"
    for kind in ("float32", "float64"):
        for whole, other in (("mm", "rows"), ("mm", "strides"), ("array", "array rows")):
            first, second = (np.array(runs[True][f"{name} {kind}"]) for name in (whole, other))
            assert 0.05 < (first[: len(second)] != second).mean() < 1, (whole, other)


def test_integers_halves_round_numbers_and_what_is_no_product_stay(runs):
    assert runs[True]["exact"] == runs[False]["exact"]


@pytest.mark.skipif("not os.environ.get('LANGFLASH_MOVED')", reason="products are not moved in this run")
def test_the_tests_themselves_run_with_moved_products():
    a = torch.rand(40, 30)
    assert not torch.equal((a @ a.T)[:7], a[:7] @ a.T)
    a = a.numpy()
    assert not np.array_equal((a @ a.T)[:7], a[:7] @ a.T)
