"""Structure from motion: matches, their graph, tracks, poses, lens (`structure.find_poses`)."""
