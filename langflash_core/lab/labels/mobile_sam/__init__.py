"""MobileSAM: masks of a photo by points, boxes and rough masks, on a processor.

`vision` is its image encoder, `prompts` and `decoder` the two small networks of SAM around it, `model` joins
them and reads a checkpoint. Parameters are called as in the published file.

Sources: Kirillov et al. 2023 (SAM); Zhang et al. 2023 (MobileSAM); Wu et al. 2022 (TinyViT).
"""
