"""Point maps: the paper's geometry."""
