"""The stages of training: which modules learn, from what, and what is measured.

Each stage trains its own modules on frozen encoder tokens; what it reads from earlier stages is frozen
too. Stages of geometry are depth, refine, gaussians; of meaning language, grouping, aggregation: the two
chains do not read each other and can run side by side.
"""
