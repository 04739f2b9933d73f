"""Saved results of `dsl run`, reused by later runs while nothing that they depend on has changed.

run_cache_keys         digest of everything that a result depends on
result_serialization   results as JSON and arrays, and back, only of known classes
warning_locations      warnings by their place in a declaration, which may have moved since
cache_folder           the folder: each file is complete or ignored, and their total size is limited
result_keeper          reuse and saving of results in a run
"""
