"""Language features, groups, parts and their names."""
