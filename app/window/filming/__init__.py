"""The camera's path: key frames, a preview, and what an export makes of them."""
