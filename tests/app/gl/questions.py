"""Queries without a text tower, pictures of a renderer made for them, and numbers that compare them."""

import math

import moderngl
import torch
from torch.nn.functional import normalize

from app.gl import SplatRenderer
from app.gl.canvas import Precision
from langflash_core.language.relevance import CompiledQuery, reduce_dictionary
from langflash_core.types import Camera, Frame, Scene


def draw(gl: moderngl.Context, precision: Precision, scene: Scene, seen: Camera, **options) -> Frame:
    """With its weight maps, by a renderer of its own."""
    renderer = SplatRenderer(gl, precision)
    renderer.set_scene(scene)
    renderer.draw(seen, **options)
    frame = renderer.frame(weight_maps=True)
    renderer.release()
    return frame


def question(
    scene: Scene, num_prompts: int = 3, mode: str = "relevancy", num_negatives: int = 4, seed: int = 1
) -> CompiledQuery:
    """Random unit phrases in the scene's own language, in float64."""
    g = torch.Generator().manual_seed(seed)
    factor, basis = reduce_dictionary(scene.semantics.dictionary.double())
    negatives = num_negatives if mode == "relevancy" else 0
    phrases = torch.randn(num_prompts + negatives, basis.shape[1], generator=g, dtype=torch.float64)
    phrases = normalize(phrases, dim=-1) @ basis.T
    return CompiledQuery(
        factor=factor,
        prompts=phrases[:num_prompts],
        negatives=phrases[num_prompts:],
        temperature=10.0,
        threshold=0.5 if mode == "relevancy" else 0.1,
        mode="relevancy" if mode == "relevancy" else "cosine",
        texts=tuple(f"phrase {i}" for i in range(num_prompts)),
    )


def full_relevance(scene: Scene, compiled: CompiledQuery, weight_maps: torch.Tensor) -> torch.Tensor:
    """Relevance (P, H, W) the long way: F = W D in all C channels, a softmax per negative."""
    _, basis = reduce_dictionary(scene.semantics.dictionary.double())
    features = weight_maps.double() @ scene.semantics.dictionary.double()  # (H, W, C)
    norms = features.norm(dim=-1)
    empty = norms < 1e-4
    unit = features / norms.clamp_min(1e-4)[..., None]
    positives = torch.einsum("hwc,pc->phw", unit, compiled.prompts @ basis)
    if compiled.mode == "cosine":
        return torch.where(empty, 0.0, positives)
    negatives = torch.einsum("hwc,pc->phw", unit, compiled.negatives @ basis)
    pairs = torch.stack(torch.broadcast_tensors(positives[:, None], negatives[None]), -1)
    shares = torch.softmax(compiled.temperature * pairs, -1)[..., 0]  # (P, M, H, W)
    return torch.where(empty, 0.0, shares.amin(1))


def psnr(left: torch.Tensor, right: torch.Tensor) -> float:
    """Peak signal-to-noise ratio in dB of images shown in [0, 1]."""
    error = (left.double().clamp(0, 1) - right.double().clamp(0, 1)).square().mean().item()
    return math.inf if error == 0 else -10 * math.log10(error)
