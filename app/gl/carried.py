"""Weights w_ij of N Gaussians over K atoms: as numbers, and as textures that shaders expand them from."""

from collections.abc import Sequence

import moderngl
import numpy as np
import torch
from torch.nn import functional as F

from langflash_core.base.graphics import Programs, set_uniforms

from .layout import ATOMS_A_LAYER

_ROW_TEXELS = 4096


class Carried:
    """ids, values: (N, J), a few atoms of each Gaussian with their weights. bits: as of `atom_bits`."""

    def __init__(self, ids: np.ndarray, values: np.ndarray, num_atoms: int):
        self.ids = ids
        self.values = values
        self.num_atoms = num_atoms
        self.bits = atom_bits(ids, values, num_atoms)

    def atoms_of(self, rows: np.ndarray, starts: np.ndarray) -> np.ndarray:
        """(runs, K) bool: atoms that Gaussians carry with a weight above 0, together in each run of `rows`,
        from `starts` on."""
        carried = np.bitwise_or.reduceat(self.bits[rows], starts, axis=0)  # (runs, words)
        bits = np.unpackbits(carried.astype("<u8").view(np.uint8), axis=1, bitorder="little")
        return bits[:, : self.num_atoms].astype(bool)

    def mixed(self, table: np.ndarray) -> np.ndarray:
        """sum_j w_ij table[id_ij], (N, n) float32, of a table (K, n)."""
        rows = torch.from_numpy(np.ascontiguousarray(table, np.float32))
        ids, values = torch.from_numpy(self.ids), torch.from_numpy(self.values)
        return F.embedding_bag(ids, rows, per_sample_weights=values, mode="sum").numpy()

    def dense(self, rows: np.ndarray, counts: Sequence[int], slots: np.ndarray, width: int) -> np.ndarray:
        """Weights (n, width + 1) float32 of `rows`, each at the place of its atom, those without one last.

        Args:
            counts: of rows that go by each line of `slots`, one line after the other.
            slots: (b, K), place of each atom, `width` for none.
        """
        ids, values = (torch.from_numpy(each[rows]) for each in (self.ids, self.values))
        first = np.repeat(slots.shape[1] * np.arange(len(slots)), counts)
        held = torch.from_numpy(slots).reshape(-1)[ids + torch.from_numpy(first)[:, None]]
        dense = torch.zeros(len(rows), width + 1)
        return dense.scatter_add_(1, held, values).numpy()


class CarriedTextures:
    """Owns the same as textures; `ready` sets up the program that expands some atoms' weights."""

    def __init__(self, ctx: moderngl.Context, programs: Programs, carried: Carried, texels: np.ndarray):
        """texels: of `texels_of` what is carried."""
        self._programs = programs
        self._a_gaussian = carried.ids.shape[1]
        self._sparse = ctx.texture(texels.shape[1::-1], 2, texels, dtype="f4")
        self._sparse.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._slots = ctx.texture((max(1, carried.num_atoms), 1), 1, dtype="f4")

    def ready(self, atoms: np.ndarray, first: int, num_layers: int) -> moderngl.Program:
        """A program whose vertices are Gaussians and whose output is their dense weights, `ATOMS_A_LAYER`
        for each of `num_layers` layers of `atoms`, from place `first` on."""
        program = self._programs.get(
            "expand.vert",
            defines={"LAYERS": num_layers, "ROW_TEXELS": _ROW_TEXELS},
            varyings=("out_weights",),
        )
        slots = np.full(self._slots.width, -1, np.float32)
        slots[atoms] = np.arange(len(atoms))
        self._slots.write(slots.tobytes())
        self._sparse.use(0)
        self._slots.use(1)
        set_uniforms(
            program, sparse_weights=0, slots=1, weights_per_gaussian=self._a_gaussian, first_slot=first
        )
        return program

    def release(self) -> None:
        self._slots.release()
        self._sparse.release()


def texels_of(carried: Carried) -> np.ndarray:
    """(rows, texels, 2) float32: atoms and weights of one Gaussian after the other."""
    count = carried.ids.size
    texels = np.zeros((max(1, -(-count // _ROW_TEXELS)), _ROW_TEXELS, 2), np.float32)
    pairs = texels.reshape(-1, 2)
    pairs[:count, 0], pairs[:count, 1] = carried.ids.ravel(), carried.values.ravel()
    return texels


def bytes_of(num_layers: int) -> int:
    """That the dense weights of a Gaussian take."""
    return 4 * ATOMS_A_LAYER * num_layers


def atom_bits(ids: np.ndarray, values: np.ndarray, num_atoms: int) -> np.ndarray:
    """(N, ceil(K / 64)) uint64: which atoms each Gaussian carries with a weight above 0."""
    bits = np.zeros((max(1, -(-num_atoms // 64)), len(ids)), np.uint64)
    for column, carries in zip(ids.T, values.T > 0, strict=True):
        masks = carries.astype(np.uint64) << (column & 63).astype(np.uint64)
        for number, word in enumerate(bits):
            word |= masks if len(bits) == 1 else np.where(column >> 6 == number, masks, np.uint64(0))
    return np.ascontiguousarray(bits.T)
