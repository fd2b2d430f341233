"""`langflash lab bench-network`: a table of the network's stages, at a size for tests."""

from langflash_core.network import PRESETS
from tests.network.sizes import TINY


def test_the_stage_table_of_the_network(run, tmp_path, monkeypatch):
    monkeypatch.setitem(PRESETS, "full", TINY)
    out = tmp_path / "network.json"
    words = ("--random", "--views", 2, 3, "--atoms", 4, 9, "--repeats", 1, "--size", 64, "-o", out)
    document = run("lab", "bench-network", *words, "--json").json()
    rows = {(r["precision"], r["views"], r["atoms"], r["stage"]): r for r in document["rows"]}
    assert len(rows) == 2 * 2 * 2 * 6 and out.is_file()
    for (precision, views, atoms, stage), row in rows.items():
        assert row["seconds"] > 0
        whole = rows[precision, views, atoms, "all"]["seconds"]
        assert row["seconds"] <= whole
        if precision == "bfloat16" and stage != "all":
            # 8 bits a number, and some thirty layers of random weights: a few per cent.
            assert 0 <= row["error"] < 0.3
    table = run("lab", "bench-network", *words, "--float32").out
    assert "| float32 | 3 | 9 | aggregation |" in table and "bfloat16" not in table
    refused = run("lab", "bench-network", "--random", "--size", 100)
    assert refused.code == 2 and "multiple of 16" in refused.err
