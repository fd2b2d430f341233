"""What draws a scene into the viewport: `card`, or where OpenGL runs on the processor `processor`, behind one
class (`picture`). Both show what stands on an `easel`; a processor's still pictures come from `stills`.

`card`, `processor`, `easel` and `stills` load torch; `picture`, `values` and `marked` do not.
"""
