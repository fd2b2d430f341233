"""SAM 2 as transformers has it, tiny and with drawn weights: what is done frame by frame is what the package
itself does with a whole video."""

import numpy as np
import pytest
import torch

from langflash_core.base.torchvision_fix import ensure_torchvision
from langflash_core.errors import WeightsError
from langflash_core.lab.labels.clips import Clip
from langflash_core.lab.labels.prompted import PromptedSam
from langflash_core.lab.labels.sam2 import Sam2Pictures, Sam2Propagator, load_sam2, normalised

pytest.importorskip("transformers")
ensure_torchvision()
pytestmark = pytest.mark.filterwarnings("default")  # of other people's packages
SIDE, SIZE = 128, (60, 80)


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    from transformers import (  # pyright: ignore[reportMissingImports]
        Sam2Config,
        Sam2Model,
        Sam2VideoConfig,
        Sam2VideoModel,
    )

    torch.manual_seed(0)
    vision = {
        "backbone_config": {
            "model_type": "sam2_hiera_det_model",
            "hidden_size": 16,
            "image_size": [SIDE, SIDE],
            "embed_dim_per_stage": [16, 32, 64, 128],
            "blocks_per_stage": [1, 2, 2, 1],
            "num_attention_heads_per_stage": [1, 1, 1, 1],
            "global_attention_blocks": [4],
            "window_size_per_stage": [8, 4, 4, 2],
            "window_positional_embedding_background_size": [4, 4],
        },
        "backbone_channel_list": [128, 64, 32, 16],
        "backbone_feature_sizes": [[32, 32], [16, 16], [8, 8]],
        "fpn_hidden_size": 128,
    }
    heads = {
        "prompt_encoder_config": {"hidden_size": 128, "image_size": SIDE},
        "mask_decoder_config": {
            "hidden_size": 128,
            "mlp_dim": 64,
            "num_hidden_layers": 1,
            "num_attention_heads": 2,
            "iou_head_hidden_dim": 32,
        },
    }
    memory = {
        "image_size": SIDE,
        "memory_attention_hidden_size": 128,
        "memory_attention_num_layers": 1,
        "memory_attention_feed_forward_hidden_size": 64,
        "memory_attention_rope_feat_sizes": [8, 8],
        "memory_encoder_hidden_size": 128,
        "memory_encoder_output_channels": 64,
        "mask_downsampler_embed_dim": 128,
        "memory_fuser_embed_dim": 128,
        "memory_fuser_intermediate_dim": 64,
        "memory_fuser_num_layers": 1,
    }
    pictures = Sam2Model(Sam2Config(vision_config=vision, **heads)).eval()
    video = Sam2VideoModel(Sam2VideoConfig(vision_config=vision, **heads, **memory)).eval()
    with torch.no_grad():  # drawn weights say that no object is there; here one always is
        video.mask_decoder.pred_obj_score_head.proj_out.bias.fill_(10.0)
    folder = tmp_path_factory.mktemp("sam2")
    pictures.save_pretrained(folder / "pictures")
    video.save_pretrained(folder / "video")
    return pictures, video, folder


@pytest.fixture(scope="module")
def clip() -> Clip:
    rng = np.random.default_rng(0)
    frames = [rng.integers(0, 255, (*SIZE, 3), dtype=np.uint8) for _ in range(5)]
    return Clip("noise", tuple("abcde"), frames.__getitem__)


def test_following_frame_by_frame_is_the_package_s_own_way_through_a_video(checkpoint, clip):
    from transformers.models.sam2_video.modeling_sam2_video import (  # pyright: ignore[reportMissingImports]
        Sam2VideoInferenceSession,
    )

    _, video, _ = checkpoint
    first = np.zeros(SIZE, np.uint16)
    first[10:40, 10:50] = 7
    following = Sam2Propagator(video).follow(clip)
    assert following.to(0).max() == 0
    following.add(0, first)
    ours = [following.to(t) for t in range(1, 5)]

    frames = torch.cat([normalised(clip.read(t), SIDE) for t in range(5)])
    session = Sam2VideoInferenceSession(
        video=frames, video_height=SIZE[0], video_width=SIZE[1], dtype=torch.float32
    )
    square = torch.nn.functional.interpolate(
        torch.from_numpy(first > 0)[None, None].float(), (SIDE, SIDE), mode="bilinear", antialias=True
    )
    session.add_mask_inputs(session.obj_id_to_idx(7), 0, (square >= 0.5).float())
    session.obj_with_new_inputs = [7]
    theirs = {}
    for found in video.propagate_in_video_iterator(session, start_frame_idx=0):
        large = torch.nn.functional.interpolate(found.pred_masks, SIZE, mode="bilinear", align_corners=False)
        theirs[found.frame_idx] = (large[0, 0] > 0).numpy()
    for frame, ids in enumerate(ours, start=1):
        # The same numbers in the same order; a pixel whose logit is 0 to rounding may fall either way.
        assert ((ids == 7) != theirs[frame]).mean() < 0.002
    assert any(ids.any() for ids in ours)


def test_objects_may_join_later(checkpoint, clip):
    _, video, _ = checkpoint
    following = Sam2Propagator(video).follow(clip)
    following.to(0)
    assert following.to(1).shape == SIZE and following.to(1).max() == 0
    late = np.zeros(SIZE, np.uint16)
    late[:30, :30], late[40:, 50:] = 1, 2
    following.add(1, late)
    assert set(np.unique(following.to(2))) <= {0, 1, 2}


def test_more_of_a_known_object_puts_its_memory_right_by_all_of_it(checkpoint, clip):
    _, video, _ = checkpoint
    following = Sam2Propagator(video).follow(clip)
    following.to(0)
    first, more = np.zeros(SIZE, np.uint16), np.zeros(SIZE, np.uint16)
    first[:30, :40], more[30:, :40] = 3, 3
    following.add(0, first)
    following.add(0, more)
    (told,) = vars(following)["_session"].mask_inputs_per_obj[0].values()
    assert abs(float(told.mean()) - 0.5) < 0.02  # the left half of the frame, to a row of the square
    assert set(np.unique(following.to(1))) <= {0, 3}


def test_it_proposes_and_refines_like_the_other_one(checkpoint, clip):
    pictures, _, _ = checkpoint
    sam = PromptedSam(Sam2Pictures(pictures), grid=3, least_score=-9, least_stability=-1)
    found = sam.propose(clip.read(0))
    assert found.masks.shape == (3 * 3 * 3, *SIZE)  # three masks a point of a grid of 3 x 3
    rough = np.zeros((2, *SIZE), bool)
    rough[0, 5:30, 5:30] = rough[1, 40:, 60:] = True
    refined = sam.refine(clip.read(0), rough, np.ones(SIZE, bool))
    assert refined.masks.shape == rough.shape


def test_a_checkpoint_that_cannot_be_had_is_a_sentence(tmp_path):
    with pytest.raises(WeightsError, match="cannot be had"):
        load_sam2(str(tmp_path))
