"""Steps lead back to where a pixel was, and say when it was nowhere."""

import numpy as np
import torch

from langflash_core.lab.labels.motion import _carried, by_flow, moved, views_of
from tests.lab.labels.painted import STEP, painted_clip


def test_flow_follows_a_wall_that_moves_along_and_knows_what_came_in():
    clip, true = painted_clip()
    step = by_flow(clip, 3, clip.read(3), clip.read(2))
    known = np.asarray(np.isfinite(step).all(-1))
    assert np.abs(np.median(step[known], 0) - (STEP, 0)).max() < 0.1  # pixels
    assert not known[:, -3:].any() and known[:, :-STEP].mean() > 0.95
    carried, _ = moved(true[2], step)
    inside = known & (carried > 0)
    assert (carried == true[3])[inside].mean() > 0.97  # borders of things may be a pixel off


def test_depth_and_pose_move_a_plane_as_geometry_says():
    """A wall at depth 2 and a camera that moves by 0.1 to the right: f * 0.1 / 2 pixels."""
    K = torch.tensor([[40.0, 0, 16], [0, 40, 12], [0, 0, 1]])
    depths = torch.full((2, 24, 32), 2.0)
    viewmats = torch.eye(4).repeat(2, 1, 1)
    viewmats[1, 0, 3] = 0.1
    step = _carried(depths, viewmats, K.repeat(2, 1, 1))
    assert np.allclose(step[..., 0], 2.0, atol=1e-5) and np.allclose(step[..., 1], 0, atol=1e-5)


def test_what_was_hidden_before_is_not_known():
    K = torch.tensor([[40.0, 0, 16], [0, 40, 12], [0, 0, 1]])
    depths = torch.full((2, 24, 32), 2.0)
    depths[1, :, 10:20] = 1.0  # something stood there
    step = _carried(depths, torch.eye(4).repeat(2, 1, 1), K.repeat(2, 1, 1))
    assert np.isnan(step[:, 12:18]).all() and np.isfinite(step[:, :8]).all()


def test_the_network_sees_a_clip_s_own_cameras_at_its_own_size():
    clip, _ = painted_clip()
    views = views_of(clip, (1, 0), (clip.read(1), clip.read(0)))
    assert views.viewmats is None and views.size[0] % 14 == 0 and views.size[1] % 14 == 0
    assert abs(float(views.Ks[0, 0, 2]) - views.size[0] / 2) < 1e-3
