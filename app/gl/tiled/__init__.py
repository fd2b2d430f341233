"""Splats by compute shaders, where OpenGL 4.3 is: projected, ordered and dealt to tiles on the card
(`lists.py`), drawn tile by tile, front to back, instead of as quads (`splats.py`). Which of both a card does
sooner a trial says (`trial.py`)."""
