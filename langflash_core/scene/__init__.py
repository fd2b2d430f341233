"""A prediction becomes a scene: assembled, pruned to what it needs, edited, kept in one file.

Names are imported from their modules: `edits` alone costs no torch.
"""
