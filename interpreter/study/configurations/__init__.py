"""From the studies of a scene to tasks: variations, the keys by which two are one, what each needs."""
