"""Relevance of single Gaussians, against their features formed one by one."""

from dataclasses import replace

import numpy as np
import torch
from torch.nn.functional import normalize

from langflash_core.language import gaussians
from langflash_core.language.gaussians import answering_shares, gaussian_relevance, photos_that_answer
from langflash_core.language.relevance import compile_query, rival_terms
from langflash_core.language.spaces import language_space
from langflash_core.types import Gaussians, Scene, Semantics


def mixed_scene(count: int = 200) -> Scene:
    """Weights over five words, two per Gaussian; the first Gaussian carries nothing."""
    rng = torch.Generator().manual_seed(0)
    dictionary = language_space("minilm").encode(["armchair", "lamp", "floor", "plant", "door"])
    values = torch.rand(count, 2, generator=rng)
    values = values / values.sum(-1, keepdim=True)
    values[0] = 0
    ids = torch.randint(0, 5, (count, 2), generator=rng)
    shapes = Gaussians(
        torch.randn(count, 3, generator=rng),
        normalize(torch.randn(count, 4, generator=rng), dim=-1),
        torch.ones(count, 3),
        torch.ones(count),
        torch.zeros(count, 1, 3),
    )
    semantics = Semantics(ids, values, dictionary, "minilm")
    return Scene(shapes, semantics, torch.eye(4)[None], torch.eye(3)[None], (8, 8))


def test_it_is_the_relevancy_of_each_feature(monkeypatch):
    monkeypatch.setattr(gaussians, "_AT_ONCE", 64)
    scene, space = mixed_scene(), language_space("minilm")
    compiled = compile_query(scene, space, ["chair", "floor"])
    found = gaussian_relevance(scene.semantics, compiled).double().numpy()
    assert found.shape == (2, 200)
    dictionary = scene.semantics.dictionary.double().numpy()
    positives = space.encode(["chair", "floor"]).double().numpy()
    negatives = space.encode(compiled.negative_texts).double().numpy()
    asked = ["chair", "floor"]
    rivals = rival_terms(scene.semantics.dictionary, space, asked, space.encode(asked)).double().numpy()
    for row in range(200):
        pairs = [
            (int(k), float(value))
            for k, value in zip(
                scene.semantics.weight_ids[row], scene.semantics.weight_values[row], strict=True
            )
        ]
        feature = sum(value * dictionary[k] for k, value in pairs)
        norm = np.linalg.norm(feature)
        for phrase in range(2):
            if norm == 0:
                assert found[phrase, row] == 0
                continue
            beaten = sum(value * rivals[k, phrase] for k, value in pairs)
            ours, others = min((positives[phrase] @ feature + beaten) / norm, 1.0), negatives @ feature / norm
            softmax = np.exp(compiled.temperature * ours)
            least = min(softmax / (softmax + np.exp(compiled.temperature * other)) for other in others)
            # float32 cosines are good to 1e-6, and relevancy moves by a quarter of temperature times that.
            assert abs(found[phrase, row] - least) < 1e-5


def test_which_photo_answers_is_counted_among_its_own_gaussians():
    """Photos 1 and 2 of three have Gaussians; of some no photo is known."""
    scene = mixed_scene()
    ids = torch.arange(200) % 3 - 1
    scene = replace(
        scene, viewmats=torch.eye(4).repeat(3, 1, 1), Ks=torch.eye(3).repeat(3, 1, 1), view_ids=ids
    )
    compiled = compile_query(scene, language_space("minilm"), ["chair", "submarine"])
    there = torch.arange(200) % 5 > 0
    hits = gaussian_relevance(scene.semantics, compiled) >= compiled.threshold
    some = [there & (ids == view) for view in (0, 1, 2, -1)]
    expected = [[float(hit[own].float().mean()) if own.any() else 0.0 for own in some] for hit in hits]
    shares = answering_shares(scene, compiled, there)
    np.testing.assert_allclose(shares.numpy(), expected, rtol=1e-6)  # of float32
    best = max((0, 1), key=lambda view: expected[0][view])
    assert photos_that_answer(shares) == (best, None) and expected[0][best] > 0
    unknown = answering_shares(replace(scene, view_ids=None), compiled)
    assert unknown.shape == (2, 4) and not unknown[:, :3].any() and unknown[0, 3] > 0
    assert photos_that_answer(unknown) == (None, None)
