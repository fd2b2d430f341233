"""What the panel says of a scene's making."""

from dataclasses import replace

import pytest

from app.window.scene.panels import stages
from app.window.state import State
from tests.app.window.headless import context, frames, look
from tests.app.window.scenes import shown_scene


def said(state: State, monkeypatch: pytest.MonkeyPatch) -> tuple[list[str], list[str]]:
    """The headings that can be opened, and the wrapped text below them."""
    headings, texts = [], []

    def opened(title: str) -> bool:
        headings.append(title.partition("###")[0])
        return True

    monkeypatch.setattr(stages, "_opened", opened)
    monkeypatch.setattr(stages.imgui, "text_wrapped", texts.append)
    with context((1280, 800)):
        frames(lambda seen: stages.draw(state, seen), look(), 1)
    return headings, texts


def test_detail_is_told_where_it_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    state = shown_scene()
    assert state.scene.info is not None and said(state, monkeypatch) == ([], [])
    detail = {"level": "normal", "elements": 12_300, "photos_psnr_db": [31.2, 30.8]}
    info = replace(state.scene.info, scene=state.scene.info.scene.with_record(detail=detail))
    headings, texts = said(state.with_scene(info=info), monkeypatch)
    assert headings == ["Detail: normal"]
    assert texts == ["normal, 12,300 Gaussians\nfrom the photos' places 31.2, 30.8 dB"]
