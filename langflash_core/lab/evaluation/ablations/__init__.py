"""`lab eval ablations`: which part of the method pays, and what its rivals cost, on the same rooms."""
