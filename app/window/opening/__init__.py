"""Finding photos and scenes: the empty window, folders, the desktop's own dialog, the clipboard."""
