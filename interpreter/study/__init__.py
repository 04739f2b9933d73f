"""Studies: what many runs of one scene tell together."""
