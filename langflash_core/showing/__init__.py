"""Scenes as they are shown to others: tours of files, and scenes in notebooks."""
