"""Ground that everything stands on: files, formats, limits, records, progress, tables of outputs; nothing of
photos or scenes. What is here without torch stays without it."""
