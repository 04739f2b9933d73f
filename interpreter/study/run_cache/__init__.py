"""Run cache: saved results of `dsl run`, reused by later runs if everything that they depend on is unchanged.

run_cache_keys         digest of everything that a result depends on
result_serialization   results as JSON and arrays, restricted to known classes
warning_locations      locations of warnings relative to declarations, which may have moved
cache_folder           folder of saved results, with a limit of its size
result_keeper          reuse and saving of results in a run
"""
