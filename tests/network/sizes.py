"""The paper's network in small: every part there, few channels, so that tests are fast; and what it sees."""

import os
from dataclasses import replace

import pytest
import torch

from langflash_core.network.presets import FULL, LSegSizes
from langflash_core.types import Views

large = pytest.mark.skipif(
    "LANGFLASH_LARGE_TESTS" not in os.environ,
    reason="minutes and gigabytes: set LANGFLASH_LARGE_TESTS=1 to run it",
)

TINY = replace(
    FULL,
    encoder_dim=48,
    encoder_depth=3,
    encoder_heads=4,
    decoder_dim=32,
    decoder_depth=4,
    decoder_heads=2,
    decoder_hooks=(2, 3, 4),
    dpt_dims=(6, 8, 12, 16),
    dpt_feature=16,
    num_queries=12,
    grouping_dim=16,
    grouping_heads=4,
    language=LSegSizes(
        dim=32, depth=4, heads=2, trained_grid=6, hooks=(0, 1, 2, 3), dpt_dims=(6, 8, 12, 16), dpt_feature=16
    ),
)


def noise_views(num_views: int = 2, height: int = 64, width: int = 64) -> Views:
    """Photos of noise, of one camera."""
    images = torch.rand(num_views, 3, height, width, generator=torch.manual_seed(num_views))
    K = torch.tensor([[0.9 * width, 0, width / 2], [0, 0.9 * width, height / 2], [0, 0, 1]])
    return Views(images, K.expand(num_views, 3, 3), tuple(f"photo {v}" for v in range(num_views)))
