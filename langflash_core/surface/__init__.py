"""A prediction becomes a scene: exposure compensation, transient masks, elements, colours (`fine`); one
surface of all layers where a format needs one (`fuse_layers`)."""
