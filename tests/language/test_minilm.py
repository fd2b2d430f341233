import time

import pytest
import torch
from safetensors.torch import load_file, save_file

from langflash_core.base.resources import asset_path
from langflash_core.errors import PromptError, WeightsError
from langflash_core.language.minilm import load_minilm, read_minilm
from langflash_core.language.settings import MINILM
from tests.language.reference import bert_twin

WEIGHTS = "weights/minilm_l6_v2_rowint8.safetensors"
VOCABULARY = "weights/minilm_l6_v2_tokenizer.json"
FURNITURE = ("couch", "table", "bed", "lamp", "wardrobe", "door", "window", "plant")
PHRASES = ("sofa", "the lamp on the desk near the window", "a very long wooden dining table with six chairs")


@pytest.fixture(scope="module")
def tower():
    return load_minilm()


@pytest.mark.parametrize(
    ("phrase", "nearest"),
    [
        ("sofa", "couch"),
        ("nightlight", "lamp"),
        ("closet for clothes", "wardrobe"),
        ("dining table", "table"),
        ("flower pot", "plant"),
        ("entrance", "door"),
    ],
)
def test_paraphrases_are_nearest(tower, phrase, nearest):
    similarities = tower.encode(FURNITURE) @ tower.encode([phrase])[0]
    assert FURNITURE[int(similarities.argmax())] == nearest


@pytest.mark.parametrize("phrase", PHRASES)
def test_equals_its_float64_twin(tower, phrase):
    twin = bert_twin(asset_path(WEIGHTS), tower.tokens(phrase))
    # Measured 1e-7 to 3e-7: six float32 layers of width 384 round at 6e-8 each.
    torch.testing.assert_close(tower.encode([phrase])[0].double(), torch.from_numpy(twin), rtol=0, atol=2e-6)


def test_padding_in_a_batch_changes_nothing(tower):
    alone = torch.cat([tower.encode([phrase]) for phrase in PHRASES])
    # 1e-5 is the promise; the masks are exact, only the order of the sums differs.
    torch.testing.assert_close(tower.encode(PHRASES), alone, rtol=0, atol=1e-5)


def test_long_lists_keep_their_order(tower):
    phrases = [f"{'big ' * (i % 5)}chair {i}" for i in range(130)]  # three batches, mixed lengths
    together = tower.encode(phrases)
    for i in (0, 4, 64, 129):
        torch.testing.assert_close(together[i], tower.encode([phrases[i]])[0], rtol=0, atol=1e-5)


def test_unit_deterministic_and_empty_list(tower):
    first = tower.encode(PHRASES)
    assert first.dtype == torch.float32
    assert torch.equal(first, tower.encode(PHRASES))
    # A float32 norm of 384 numbers rounds below 1e-6.
    torch.testing.assert_close(first.norm(dim=1), torch.ones(3), rtol=0, atol=1e-6)
    assert tower.encode([]).shape == (0, 384)


@pytest.mark.parametrize("phrase", ["", "   ", "\n\t", "\u200b"])
def test_empty_prompts_are_refused(tower, phrase):
    with pytest.raises(PromptError, match="empty"):
        tower.encode(["sofa", phrase])


def test_a_prompt_of_unknown_signs_is_refused(tower):
    with pytest.raises(PromptError, match="no word"):
        tower.encode(["\U0001fa91"])


def test_unicode(tower):
    accents, plain = tower.encode(["CANAPÉ", "canape"])
    assert torch.allclose(accents, plain, atol=1e-5)  # case and accents are folded before lookup
    for phrase in ("椅子", "стул", "sofa \U0001fa91", "chair \udcff"):
        assert torch.isfinite(tower.encode([phrase])).all()


def test_long_prompts_are_cut_at_the_models_maximum(tower):
    long = "chair " * 300
    assert len(tower.tokens(long)) == MINILM.max_tokens
    torch.testing.assert_close(tower.encode([long]), tower.encode([long + "and a lamp"]), rtol=0, atol=0)


# Processor time of one thread, the best of several: other work on the machine does not count.


def test_fast_enough_to_type_with(tower):
    seconds = []
    for i in range(20):
        start = time.process_time()
        tower.encode([f"a red armchair {i}"])
        seconds.append(time.process_time() - start)
    assert min(seconds) < 0.050  # a fast typist's keys are 100 ms apart; measured 5 to 12 ms by machine


def test_loads_in_a_second():
    seconds = []
    for _ in range(3):
        start = time.process_time()
        read_minilm(asset_path(WEIGHTS), asset_path(VOCABULARY))
        seconds.append(time.process_time() - start)
    assert min(seconds) < 1.0  # measured 0.2 s
    assert load_minilm() is load_minilm()


def test_damaged_files_are_one_sentence(tmp_path):
    weights, vocabulary = asset_path(WEIGHTS), asset_path(VOCABULARY)
    cut = tmp_path / "cut.safetensors"
    cut.write_bytes(weights.read_bytes()[:100_000])
    foreign = tmp_path / "foreign.json"
    foreign.write_text("{}")
    lacking = tmp_path / "lacking.safetensors"
    tensors = load_file(weights)
    del tensors["encoder.layer.3.output.dense.bias"]
    save_file(tensors, lacking)
    for pair in (
        (cut, vocabulary),
        (weights, foreign),
        (lacking, vocabulary),
        (tmp_path / "none", vocabulary),
    ):
        with pytest.raises(WeightsError, match="reinstall LangFlash"):
            read_minilm(*pair)
