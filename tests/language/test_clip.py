"""open_clip's real text tower, with random weights: nothing is downloaded."""

import pytest
import torch
from safetensors.torch import save_file

from langflash_core.errors import PromptError, WeightsError
from langflash_core.language.clip import build_clip, load_clip
from langflash_core.language.spaces import language_space


@pytest.fixture(scope="module")
def tower():
    torch.manual_seed(0)
    return build_clip()


@pytest.fixture(autouse=True)
def forget_towers(monkeypatch, tmp_path):
    monkeypatch.delenv("LANGFLASH_CLIP", raising=False)
    monkeypatch.setenv("LANGFLASH_HOME", str(tmp_path))
    load_clip.cache_clear()
    yield
    load_clip.cache_clear()


def test_encodes_phrases(tower):
    embeddings = tower.encode(["sofa", "a chair by the window", "椅子"])
    assert embeddings.shape == (3, 512)
    # A float32 norm of 512 numbers rounds below 1e-6.
    torch.testing.assert_close(embeddings.norm(dim=1), torch.ones(3), rtol=0, atol=1e-6)
    # All phrases are padded to 77 tokens: a batch differs by the order of sums only.
    torch.testing.assert_close(tower.encode(["sofa"])[0], embeddings[0], rtol=0, atol=1e-5)
    assert not torch.allclose(embeddings[0], embeddings[1], atol=1e-3)
    assert tower.encode([]).shape == (0, 512)


def test_empty_prompts_and_long_ones(tower):
    with pytest.raises(PromptError, match="empty"):
        tower.encode(["  "])
    assert torch.isfinite(tower.encode(["chair " * 300])).all()


def test_weights_come_back_from_a_file(tower, tmp_path, monkeypatch):
    state = {name: tensor.contiguous() for name, tensor in tower.model.state_dict().items()}
    state["visual.proj"] = torch.zeros(2, 2)  # a full checkpoint: its image half is left aside
    (tmp_path / "weights").mkdir()
    home = tmp_path / "weights" / "clip_vitb32.safetensors"
    save_file(state, home)
    assert torch.equal(language_space("clip").encode(["sofa"]), tower.encode(["sofa"]))
    load_clip.cache_clear()
    elsewhere = tmp_path / "elsewhere.pt"
    home.unlink()
    torch.save(state, elsewhere)
    monkeypatch.setenv("LANGFLASH_CLIP", str(elsewhere))
    assert torch.equal(load_clip().encode(["sofa"]), tower.encode(["sofa"]))


def test_missing_weights_say_where_to_put_them(tmp_path):
    with pytest.raises(WeightsError, match=r"clip_vitb32\.safetensors") as caught:
        language_space("clip").encode(["sofa"])
    assert str(tmp_path) in str(caught.value)
    with pytest.raises(WeightsError, match="neither a file nor a tag"):
        load_clip("no-such-tag")


def test_foreign_and_damaged_files(tmp_path):
    foreign, text = tmp_path / "foreign.safetensors", tmp_path / "text.pt"
    save_file({"weight": torch.zeros(3)}, foreign)
    text.write_text("not a checkpoint")
    with pytest.raises(WeightsError, match="does not hold CLIP"):
        load_clip(str(foreign))
    with pytest.raises(WeightsError, match="damaged"):
        load_clip(str(text))
