"""Configurations of studies: variations of a scene, their keys, and the tasks that compute them."""
