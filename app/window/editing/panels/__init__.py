"""Tools, the pointer, the list of edits."""
