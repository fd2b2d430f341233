"""Photos to a scene, stage by stage: what was asked for (`wishes`), the network and how it is used
(`tools`, `networks`), the views and what the network finds in them (`views`, `finding`), the scene
(`stages`), and its fit to the photos (`refining`). `pipeline.reconstruct` is the way in.
"""
