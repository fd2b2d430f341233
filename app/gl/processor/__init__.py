"""What is done otherwise where OpenGL runs on the processor (llvmpipe), beside the same pictures.

`sprites` in place of quads, weight maps in `cells` (`cell_maps`), answers by numpy (`host`), pictures that
are gone in a moment (`moving`), and pictures at rest by threads of Python (`artist`, `still`).
`app/gl/hardware.py` says where which is taken.
"""
