"""How sizes are said."""

from langflash_core.base.memory import told_bytes


def test_bytes_are_told_in_a_few_digits():
    told = {0: "0.0 MB", 14_640_000: "14.6 MB", 999_000_000: "999.0 MB", 1_540_000_000: "1.5 GB"}
    assert {size: told_bytes(size) for size in told} == told
