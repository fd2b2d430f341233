"""Continuous semantic label collection: what is where in every frame of a clip, as ids that stay, and what
each id is, as one vector of a language space.

`clips` reads frames; `protocols` says what proposes masks, follows them and embeds them, `mobile_sam`,
`prompted`, `groups`, `motion`, `following`, `sam2` and `embedding` do; `collecting` is the algorithm;
`storage` keeps its result, `re10k` puts it into RealEstate10K's chunks, `report` shows it.
"""
