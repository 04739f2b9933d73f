"""Configurations of studies: variations of a scene, keys of their results, and the tasks that compute them."""
