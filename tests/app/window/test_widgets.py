"""Parts of panels that can be asked without a window."""

from types import SimpleNamespace

from app.window.kit import widgets


def test_a_long_text_is_shortened_by_few_measurements(monkeypatch) -> None:
    asked = []

    def measured(text: str) -> SimpleNamespace:
        asked.append(text)
        return SimpleNamespace(x=10.0 * len(text))

    monkeypatch.setattr(widgets.imgui, "calc_text_size", measured)
    text = "word " * 200
    short = widgets.shortened(text, 300.0)
    assert short.endswith("...") and len(short) * 10 <= 300 and len(short) >= 29
    assert len(asked) <= 12  # a logarithm of its 1,000 letters
    assert widgets.shortened("door", 300.0) == "door"
