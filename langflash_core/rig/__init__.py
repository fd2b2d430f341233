"""Photos whose places are known: one record, where points lie in them, and which are neighbours."""
