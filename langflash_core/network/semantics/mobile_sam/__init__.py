"""MobileSAM: masks of a photo by points, boxes and rough masks, on a processor.

Its image encoder is `network.encoders.mobile_sam`, `prompts` and `decoder` are the two small networks of SAM
around it, `model` joins them and reads a checkpoint, `rough` makes prompts of rough masks. Parameters of
these are called as in the published file.

Sources: Kirillov et al. 2023 (SAM); Zhang et al. 2023 (MobileSAM).
"""
