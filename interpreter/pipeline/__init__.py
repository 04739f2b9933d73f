"""Pipeline of a run, from the text of a scene to its report.

run_pipeline     all steps in order, in one function
run_options      options of a run, and its input
run_state        results found so far
saved_results, cached_results   results saved by an earlier run, and their reuse
probe_sampling, model_runs, reference_runs, report_assembly   the steps
contact_surface_fields, stress_surface_fields, rigid_body_shapes   fields and shapes for pictures
run_environment, scene_declarations   entries of the report about its scene and the machine
"""
