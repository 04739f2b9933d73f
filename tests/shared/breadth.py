"""Which cases of broad tests are quick: one or a few of each kind. The others, and what has none, wait for `-m slow`.

A test is here where its cases take seconds together, and where the quick ones find what breaks all of them. A case
is quick if its id contains one of the words that stand here.
"""

from __future__ import annotations

import pytest

NONE: tuple[str, ...] = ()
LAWS = ("small", "corotational", "neo_hookean", "st_venant_kirchhoff")  # and one that has constants of its own
STEPS = ("trapezoidal", "bdf2", "central_differences")  # one step with velocities, several steps, explicit

QUICK: dict[str, dict[str, tuple[str, ...]]] = {
    "tests/interpreter/test_authors_mesh.py": {
        "test_distance_from_the_scan": NONE,
        "test_tip": NONE,
    },
    "tests/interpreter/test_axisymmetric.py": {
        "test_linear_answers_are_those_of_scikit_fem": ("quad8",),
        "test_pressures_around_an_axis_are_those_of_scikit_fem": ("tri6-0.5",),
    },
    "tests/interpreter/test_beds.py": {
        "test_a_block_let_go_on_springs_and_dashpots": NONE,
        "test_a_block_sinks_by_pressure_over_stiffness": ("tet4", "tet10", "small, size", "finite, size"),
    },
    "tests/interpreter/test_cli_run.py": {
        "test_exit_status": ("< 10 %", "etta", "100 mm"),
        "test_interruption_keeps_what_was_finished": NONE,
    },
    "tests/interpreter/test_compare_page.py": {
        "test_every_label_is_on_the_page_and_in_the_terminal": (
            "usual", "no analysis", "two scenes", "asking", "far below",
        ),
        "test_in_chromium": ("usual",),
    },
    "tests/interpreter/test_compile.py": {
        "test_a_long_chain_of_parameters_in_either_order": NONE,
        "test_ten_thousand_lines": NONE,
    },
    "tests/interpreter/test_converged_beam.py": {
        "test_tip_within_half_a_per_cent_of_the_length": ("hex8",),
    },
    "tests/interpreter/test_curves.py": {
        "test_a_scene_without_curves_reads_and_imports_nothing_of_them": NONE,
    },
    "tests/interpreter/test_environment.py": {
        "test_a_disk_that_is_full": NONE,
        "test_a_journal_that_does_not_fit": NONE,
        "test_a_reader_that_goes_away": NONE,
        "test_few_files": NONE,
        "test_homes_caches_and_folders_that_are_not_there": ("/dev/null",),
        "test_streams_that_are_closed": ("arguments0",),
        "test_terminals_that_lack_characters": NONE,
        "test_who_ignores_signals_goes_on_doing_so": NONE,
    },
    "tests/interpreter/test_far_stress.py": {
        "test_on_a_whole_surface_it_makes_a_uniform_stress": NONE,
    },
    "tests/interpreter/test_files_and_selections.py": {
        "test_a_selection_is_refused_only_where_it_misses_the_surface": ("cylinder",),
        "test_studies_of_one_model_are_not_stopped_by_another": NONE,
    },
    "tests/interpreter/test_first_touch.py": {
        "test_a_rod_imports_nothing_while_its_clock_runs": NONE,
        "test_nothing_is_searched_for_among_modules_and_no_thread_waits_awake": NONE,
    },
    "tests/interpreter/test_fuzz_corpus.py": {
        "test_reading_a_scene_does_nothing_but_read": NONE,
    },
    "tests/interpreter/test_fuzz_scenes.py": {
        "test_some_are_sound_and_every_constructor_occurs": NONE,
    },
    "tests/interpreter/test_graded.py": {
        "test_a_scene_without_any_loads_none_of_this": NONE,
    },
    "tests/interpreter/test_groups.py": {
        "test_a_scene_without_groups_imports_nothing_for_them": NONE,
    },
    "tests/interpreter/test_homogeneous.py": {
        "test_a_force_may_pull": NONE,
        "test_a_scene_of_one_material_point_loads_no_mesh": NONE,
        "test_grips_that_hold_a_width_leave_no_stated_error": NONE,
        "test_measures_of_strain_are_those_of_finite_elements": NONE,
        "test_round_bodies_have_the_force_of_their_section": ("tube",),
        "test_states_of_stretch_are_those_of_one_mesh": ("confined",),
    },
    "tests/interpreter/test_incompressible.py": {
        "test_forms_agree_and_say_nothing_of_locking": NONE,
        "test_the_limit_in_a_scene": ("0.4999-",),
    },
    "tests/interpreter/test_large_stretch.py": {
        "test_a_gripped_strip_at_half_its_length_again": NONE,
        "test_a_gripped_strip_at_three_times_its_length": NONE,
        "test_three_times_its_length_in_every_formulation": ("isochoric-0.4999-equibiaxial",),
    },
    "tests/interpreter/test_levers.py": {
        "test_a_capped_state_has_its_metrics_and_its_residual": NONE,
        "test_a_start_saves_steps_and_is_charged": NONE,
        "test_levers_are_fields_that_overrides_change": NONE,
        "test_levers_that_cost_no_accuracy": NONE,
        "test_what_simulators_do_in_a_step_is_no_solution": NONE,
    },
    "tests/interpreter/test_library.py": {
        "test_the_list_of_the_library_needs_no_arrays": NONE,
    },
    "tests/interpreter/test_line_loads.py": {
        "test_nodes_take_what_halving_without_faces_finds": ("tet4", "hex8"),
    },
    "tests/interpreter/test_made_once.py": {
        "test_a_comparison_compiles_each_variation_once": NONE,
    },
    "tests/interpreter/test_mass_spring.py": {
        "test_a_fit_is_at_least_as_good_where_it_was_made": NONE,
        "test_the_report_says_what_was_fitted_and_judges_at_full_load": NONE,
        "test_the_sagging_beam": ("hex8",),
    },
    "tests/interpreter/test_measured.py": {
        "test_with_the_printed_modulus_it_is_six_millimetres_away": NONE,
    },
    "tests/interpreter/test_metrics_shown.py": {
        "test_compare_shows_metrics_that_need_no_reference": NONE,
    },
    "tests/interpreter/test_metrics_surfaces.py": {
        "test_concentric_spheres_are_the_difference_of_their_radii_apart": ("nearest",),
    },
    "tests/interpreter/test_models.py": {
        "test_solid_beam_approaches_beam_theory_as_it_is_refined": NONE,
    },
    "tests/interpreter/test_motion_judged.py": {
        "test_a_spin_that_gains_energy_is_never_converged_in_silence": NONE,
    },
    "tests/interpreter/test_motion_scenes.py": {
        "test_a_pulse_between_two_steps_moves_the_body": ("bdf2",),
        "test_overshoot": ("sudden",),
        "test_what_comes_to_rest_rests_where_the_static_analysis_is": NONE,
    },
    "tests/interpreter/test_moving_beams.py": {
        "test_a_free_bar_flies_on_and_turns_about_its_centre": NONE,
        "test_it_comes_to_rest_where_the_static_analysis_is": NONE,
    },
    "tests/interpreter/test_moving_networks.py": {
        "test_at_rest_it_is_as_stiff_as_at_rest": NONE,
        "test_it_moves_alike_seen_from_another_side": NONE,
        "test_momenta_of_a_free_star": NONE,
    },
    "tests/interpreter/test_networks.py": {
        "test_a_scene_without_networks_imports_nothing_for_them": NONE,
    },
    "tests/interpreter/test_parts.py": {
        "test_a_border_along_the_surface_says_what_is_open": NONE,
        "test_areas_on_flat_faces": ("12 mm-", "7.85", "0.00012-"),
        "test_bands_and_segments_on_a_cylinder": ("tet10",),
        "test_cut_by_a_plane_the_sphere_has_the_area_of_its_facets": ("tet4", "hex8"),
        "test_random_selections_are_those_of_samples_and_of_the_watchdog": ("2", "7"),
        "test_selections_along_a_sphere_take_all_of_it": ("hex8-2", "tet4-2"),
    },
    "tests/interpreter/test_plane.py": {
        "test_a_point_force_is_one_of_the_plane": ("quad9",),
        "test_a_pulled_strip_in_plane_stress": ("neo_hookean_isochoric", "st_venant_kirchhoff"),
        "test_linear_answers_are_those_of_scikit_fem": (
            "quad9-plane_strain", "quad4-plane_stress", "tri6-plane_strain",
        ),
        "test_stress_does_not_know_the_thickness": ("quad4",),
    },
    "tests/interpreter/test_recovery_scenes.py": {
        "test_springs_at_rest_or_folded": NONE,
        "test_the_same_equilibrium_or_none": ("inverted",),
    },
    "tests/interpreter/test_reduced_models.py": {
        "test_a_reduced_body_moves_as_the_full_one": NONE,
        "test_a_training_without_equilibrium_is_told": NONE,
        "test_explicit_steps_take_the_unit_mass_of_the_space": NONE,
    },
    "tests/interpreter/test_regions.py": {
        "test_a_scene_without_regions_loads_none_of_this": NONE,
        "test_layers_behind_one_another_lengthen_by_their_own_moduli": ("hex8", "hex20"),
        "test_what_a_polygon_misses_of_a_core_is_not_stated_as_whole_cells_of_another_material": NONE,
    },
    "tests/interpreter/test_report_browser.py": {
        "test_in_chromium": ("1280",),
        "test_odd_reports_in_chromium": ("hostile",),
        "test_shapes_in_chromium": NONE,
    },
    "tests/interpreter/test_sandbox.py": {
        "test_checking_and_planning_open_nothing_but_the_scene_its_folder_and_softmark": NONE,
        "test_no_value_is_run": ("HOME",),
    },
    "tests/interpreter/test_self_converged.py": {
        "test_a_hanging_column_is_round": NONE,
        "test_a_pressed_column": ("methods1",),
        "test_a_sheared_column": NONE,
        "test_a_short_round_beam_is_that_of_another_method": NONE,
        "test_a_slow_part_that_hides_behind_a_fast_one_is_in_the_estimate": NONE,
        "test_locking_is_refused": ("methods0",),
        "test_metrics_carry_its_uncertainty": NONE,
        "test_the_report_says_what_it_is_worth": NONE,
    },
    "tests/interpreter/test_standing_law.py": {
        "test_truth_is_that_of_scikit_fem": NONE,
    },
    "tests/interpreter/test_stated.py": {
        "test_no_model_is_silent_about_an_error": NONE,
        "test_the_error_in_a_norm_of_strains_is_stated_in_it": NONE,
    },
    "tests/interpreter/test_stated_finer.py": {
        "test_a_cylinder_of_hexahedra_states_what_its_flat_facets_miss": NONE,
        "test_a_finer_space_is_solved_in_what_bends_too": NONE,
        "test_a_mesh_from_a_file_has_one": ("tet4",),
        "test_elements_that_lock_have_one_that_holds_or_none": NONE,
        "test_the_displacement_of_a_point_has_one_in_metres": NONE,
        "test_they_hold_the_true_ones_and_shrink_with_the_mesh": ("tet4",),
        "test_what_means_of_the_volume_leave_out_is_no_error_of_a_strain": NONE,
    },
    "tests/interpreter/test_stretches.py": {
        "test_shares_of_cross_sections": tuple(f"shape{i}-" for i in range(7)),
        "test_shares_of_oblique_sections_against_points": ("0", "3", "5"),
    },
    "tests/interpreter/test_study_cli.py": {
        "test_a_folder_with_finished_tasks_is_refused_unless_told": NONE,
        "test_a_model_is_timed_once_the_second_time_from_the_journal": NONE,
        "test_a_reference_that_fails_is_status_3": NONE,
        "test_a_variation_in_error_is_a_failed_point_and_status_3": NONE,
        "test_an_unfinished_journal_is_gone_on_with": NONE,
        "test_python_keeps_a_folder_that_is_named": NONE,
        "test_the_same_from_python": NONE,
        "test_two_scenes_in_one_comparison": NONE,
        "test_what_has_changed_between_two_results": NONE,
    },
    "tests/interpreter/test_study_clock.py": {
        "test_a_run_beside_a_busy_loop_is_flagged": NONE,
        "test_all_runs_are_on_one_processor_and_the_parent_keeps_off_it": NONE,
        "test_phases_of_a_solid_are_mostly_tangents_and_factors": NONE,
        "test_rounds_are_interleaved_and_every_run_is_a_process_of_its_own": NONE,
        "test_what_does_not_converge_is_run_once_and_says_so": NONE,
        "test_what_is_done_already_is_not_done_again": NONE,
    },
    "tests/interpreter/test_study_kill.py": {
        "test_an_interrupt_keeps_what_is_finished_and_says_how_to_go_on": NONE,
    },
    "tests/interpreter/test_study_pool.py": {
        "test_a_cluster_finds_the_same": NONE,
        "test_a_killed_worker_of_ours": NONE,
        "test_one_worker_and_two_find_the_same_as_this_process": NONE,
    },
    "tests/interpreter/test_study_review.py": {
        "test_a_model_that_is_measured_against_is_a_truth_too": NONE,
        "test_labels_leave_out_the_name_of_the_own_model": NONE,
        "test_scenes_of_one_title_are_told_apart": NONE,
        "test_values_that_change_the_truth_are_problems_of_their_own": NONE,
        "test_warnings_belong_to_the_models_that_they_are_about": NONE,
        "test_what_only_refines_is_one_problem": NONE,
    },
    "tests/interpreter/test_supports_as_geometry.py": {
        "test_narrow_and_wide_hold_the_conforming_answer_between_them": ("0",),
        "test_scenes_of_the_library_get_the_meshes_that_they_had": NONE,
    },
    "tests/interpreter/test_tendons.py": {
        "test_any_tendons_come_to_the_theory_with_the_square_of_the_segments": NONE,
        "test_between_guides_a_tendon_is_straight": NONE,
    },
    "tests/interpreter/test_turned.py": {
        "test_a_turn_that_cells_cannot_follow_is_no_answer": NONE,
    },
    "tests/interpreter/test_values.py": {
        "test_a_scene_without_values_imports_nothing_of_them": NONE,
    },
    "tests/interpreter/test_viscous.py": {
        "test_a_time_is_the_same_from_the_one_before_and_from_the_start": NONE,
        "test_elastic_bodies_load_nothing_of_what_remembers": NONE,
        "test_energy_of_a_law_that_is_not_convex_is_said_to_be_unknown_in_a_motion": NONE,
    },
    "tests/interpreter/test_viscous_beams.py": {
        "test_a_zener_mass_swings_with_its_damped_period": NONE,
        "test_what_is_swung_about_loses_what_its_springs_lose": NONE,
    },
    "tests/interpreter/test_watchdog.py": {
        "test_an_answer_that_is_none_is_refused": ("small",),
        "test_loads_on_surfaces_and_imposed_motion_are_checked": NONE,
        "test_solids_with_pressures_are_checked_again": NONE,
    },
    "tests/grammar/test_extremes.py": {
        "test_what_is_long_and_right_is_parsed": NONE,
        "test_what_is_long_and_wrong_is_refused_briefly": ("numbers", "broken", "quotes", "bracket", "equal"),
        "test_what_is_too_deep_is_refused": ("minus", "bracket"),
    },
    "tests/grammar/test_print.py": {
        "test_an_expression_survives_printing": NONE,
        "test_comments_anywhere_are_kept": NONE,
    },
    "tests/references/test_porous_theories.py": {
        "test_a_ramp_against_finite_volumes": ("False-both", "True-held"),
    },
    "tests/references/test_surface.py": {
        "test_icp_hides_what_looks_like_a_motion": NONE,
        "test_two_reconstructions_of_one_scan_agree_to_half_a_millimetre": NONE,
    },
    "tests/references/test_surfaces.py": {
        "test_closest_point_of_a_triangle_against_another_method": NONE,
    },
    "tests/references/test_virtual_scan.py": {
        "test_more_noise_and_coarser_voxels_make_more_error": NONE,
    },
    "tests/solvers/test_checks.py": {
        "test_forces_and_volumes_with_pressures": (*LAWS, "0.3-ogden"),
        "test_forces_are_the_slope_of_an_energy_written_anew": (*LAWS, "ogden"),
    },
    "tests/solvers/test_colliding.py": {
        "test_derivatives": ("False-tet4", "True-hex8", "True-tet10"),
        "test_patch": ("hex8",),
    },
    "tests/solvers/test_combined.py": {
        "test_volume_is_the_closed_form_but_for_what_facets_miss": ("lens-", "in boxes-"),
        "test_what_they_hold_is_what_their_parts_say": ("corner taken-", "a lens-"),
    },
    "tests/solvers/test_courses.py": {
        "test_a_short_pulse_is_its_impulse": STEPS,
        "test_order_under_a_pulse_that_begins_and_ends_between_steps": STEPS,
        "test_order_under_ramps_whose_kinks_are_between_steps": STEPS,
    },
    "tests/solvers/test_damping_state.py": {
        "test_a_body_without_forces_flies_on": ("bdf2",),
        "test_the_first_overshoot_of_a_nearly_incompressible_body_does_not_hang_on_the_step": NONE,
        "test_what_is_stiff_does_not_brake_what_is_slow": NONE,
    },
    "tests/solvers/test_dynamics.py": {
        "test_a_support_that_moves": ("implicit_euler",),
        "test_amplification_and_period": STEPS,
        "test_damping_between_a_moving_support_and_the_body": NONE,
        "test_linear_momentum_of_a_free_body": STEPS,
        "test_rayleigh_damping_ratio": NONE,
        "test_work_of_a_step_load": NONE,
    },
    "tests/solvers/test_dynamics_balance.py": {
        "test_a_cantilever_over_six_decades_of_steps": ("central_differences",),
        "test_a_stiff_body_that_spins_too_fast_for_the_step_never_comes_out_as_converged_with_a_gain": (
            "midpoint", "bdf2",
        ),
        "test_steps_over_six_decades_are_right_or_said_to_be_wrong": ("central_differences",),
    },
    "tests/solvers/test_dynamics_lagged.py": {
        "test_trajectories_are_those_of_newton": STEPS,
        "test_with_damping_moving_supports_and_courses_of_loads": NONE,
    },
    "tests/solvers/test_dynamics_solids.py": {
        "test_every_mode_of_a_solid_moves_as_one_oscillator": STEPS,
        "test_momentum_of_a_free_spinning_block": STEPS,
        "test_step_load_on_a_clamped_bar": STEPS,
    },
    "tests/solvers/test_elastic.py": {
        "test_a_tangled_minimum_is_refused": NONE,
        "test_derivatives_at_unit_scale": (*LAWS, "1-ogden", "1-mooney"),
        "test_kernels_against_einsum": (*LAWS, "ogden"),
    },
    "tests/solvers/test_elements.py": {
        "test_points_on_faces_edges_and_corners_have_the_values_that_any_cell_there_gives": NONE,
    },
    "tests/solvers/test_ellipticity.py": {
        "test_what_is_lost_is_what_some_direction_loses": ("kirchhoff-0.3", "hookean-0.45"),
    },
    "tests/solvers/test_folds.py": {
        "test_none_is_missed_and_none_is_blamed": ("tet10-60", "hex8-60"),
    },
    "tests/solvers/test_impact.py": {
        "test_a_bar_leaves_a_wall_as_the_integrator_lets_it": ("implicit_euler", "bdf2"),
        "test_a_block_dropped_on_a_corner_and_dragged_over_it": NONE,
    },
    "tests/solvers/test_jit.py": {
        "test_a_disk_that_is_full_keeps_no_kernel_and_stops_nothing": NONE,
        "test_a_folder_in_the_place_of_a_kernel_is_done_without": NONE,
        "test_a_kernel_elsewhere_whose_constant_is_edited": NONE,
        "test_a_kernel_that_was_spoilt_is_compiled_anew": NONE,
        "test_a_kernel_under_the_name_of_another_is_not_taken": NONE,
        "test_a_source_that_is_edited_while_a_process_starts": NONE,
        "test_an_edited_callee_is_never_answered_from_the_cache": NONE,
        "test_without_a_home_nothing_is_written_where_one_happens_to_be": NONE,
    },
    "tests/solvers/test_laws.py": {
        "test_a_bent_bar_is_that_of_felupe": ("mooney_rivlin", "ogden", "gent"),
        "test_derivatives_with_every_energy_of_the_volume": ("ogden", "mooney"),
    },
    "tests/solvers/test_linear.py": {
        "test_what_is_known_of_a_pattern_goes_with_it": NONE,
    },
    "tests/solvers/test_linear_methods.py": {
        "test_a_model_without_pardisos_library_says_what_solved_it": ("later",),
        "test_pardiso_without_its_library_gives_way": ("later-True",),
    },
    "tests/solvers/test_material_point.py": {
        "test_states_of_stretch_are_those_of_closed_forms": ("-0.49",),
    },
    "tests/solvers/test_measures.py": {
        "test_what_is_lost_never_comes_back_and_the_rest_is_stored": ("green", "small"),
    },
    "tests/solvers/test_mesh.py": {
        "test_other_cells_fill_the_same_body": ("tet10", "hex8", "hex20"),
    },
    "tests/solvers/test_mesh_distort.py": {
        "test_patch_test": ("0.1-hex27", "0.001-hex20", "hex8", "tet"),
        "test_the_worst_cell_has_the_quality_that_was_asked_for": ("0.2-hex8", "0.2-tet10"),
    },
    "tests/solvers/test_orders_solids.py": {
        "test_order_of_a_manufactured_solution": (
            "hex8-full-edges1-order1-small", "hex8-selective", "hex27-full-edges5-order5-small",
        ),
        "test_order_on_curved_bodies": ("hex8", "tet4"),
        "test_straight_edges_limit_quadratic_tetrahedra": NONE,
    },
    "tests/solvers/test_orders_time.py": {
        "test_bdf2_keeps_its_order_over_unequal_steps": NONE,
        "test_order_of_a_linear_vibration": ("bdf2",),
        "test_order_of_a_nonlinear_problem": ("central_differences",),
    },
    "tests/solvers/test_peers.py": {
        "test_neo_hookean_isochoric_against_felupe": NONE,
        "test_neo_hookean_logarithmic_against_felupe": NONE,
    },
    "tests/solvers/test_plane_stress.py": {
        "test_derivatives": (*LAWS, "mooney"),
        "test_the_check_finds_the_same_by_halving": (*LAWS, "ogden"),
    },
    "tests/solvers/test_polygonal_shapes.py": {
        "test_a_band_of_a_cone_is_a_frustum": NONE,
        "test_flat_sided_bodies_have_their_volume_and_sound_cells": ("angle-",),
        "test_the_whole_surface_is_closed_and_of_its_area": ("cone-",),
        "test_turned_bodies_are_met_with_the_order_of_the_facets": ("tip-", "tube-"),
    },
    "tests/solvers/test_recovery.py": {
        "test_every_disturbance_of_tetrahedra": ("spun", "flattened"),
        "test_other_elements": ("few-scrambled-hex8", "few-inverted-tet10", "flattened"),
        "test_scrambled_tetrahedra_find_back": ("neo_hookean-1.0",),
        "test_springs_say_that_they_are_folded": NONE,
        "test_st_venant_kirchhoff_finds_back_or_names_its_inverted_cells": NONE,
    },
    "tests/solvers/test_refine.py": {
        "test_it_is_the_same_body_and_holds_the_coarse_space": ("box", "tet4", "hex8", "hex20", "hex27"),
    },
    "tests/solvers/test_revolved.py": {
        "test_derivatives_of_a_pressure_on_rings": ("hex8",),
        "test_derivatives_of_every_law_with_one_mean_in_each_cell": ("neo_hookean_isochoric", "kirchhoff"),
        "test_derivatives_of_the_energy": ("finite",),
        "test_derivatives_with_pressures": ("finite",),
        "test_forces_with_pressures_found_again": ("finite-hex8", "small-hex27"),
    },
    "tests/solvers/test_rod_motion.py": {
        "test_momenta_of_a_free_rod_that_spins_and_bends": ("midpoint", "generalized_alpha"),
        "test_order_in_time": ("midpoint", "bdf2"),
        "test_order_in_time_of_loads_and_supports_that_turn": NONE,
    },
    "tests/solvers/test_rod_tendons.py": {
        "test_a_free_rod_is_not_moved_by_its_tendon": NONE,
        "test_the_tangent_in_motion_is_the_derivative_of_the_forces": ("TurnedGuides",),
    },
    "tests/solvers/test_solids.py": {
        "test_scrambled_cube_recovers": ("0", "4", "9"),
    },
    "tests/solvers/test_statics.py": {
        "test_a_column_stands_below_its_buckling_load_and_leans_above": ("corotational-True", "neo_hookean-False"),
        "test_both_ways_find_the_same_equilibrium": ("corotational", "neo_hookean-True"),
        "test_what_is_not_a_number_is_never_returned": ("broken1-0.001-True", "broken2-0.001-True", "-1.0"),
    },
    "tests/solvers/test_viscous.py": {
        "test_a_mass_on_zeners_spring_in_every_integrator": NONE,
        "test_the_loss_tangent_is_that_of_the_series_to_second_order": ("0.1-",),
    },
    "tests/test_architecture.py": {
        "test_checking_a_scene_imports_no_numerics_and_looks_for_no_data": ("check",),
        "test_commands_that_compute_nothing_import_no_numerics": ("command2", "command3", "command8"),
        "test_kernels_on_disk_are_loaded_without_the_compiler": NONE,
    },
}  # fmt: skip

# the other way round: of tests with many quick cases, those whose id has one of these words wait
WAIT: dict[str, dict[str, tuple[str, ...]]] = {
    "tests/interpreter/test_codes.py": {
        "test_examples": (
            "W318", "W361", "W362", "W659", "W388", "W630", "E631", "E520", "W371", "W352", "W368", "W315",
        ),
    },
    "tests/interpreter/test_diagnostics.py": {
        "test_golden": ("load-border-along-surface", "support-thin-skin", "contact-cut-in"),
    },
    "tests/interpreter/test_fuzz_corpus.py": {"test_what_broke_a_promise_keeps_it": ("comparison-long", "sweep-long")},
    "tests/interpreter/test_hostile_texts.py": {"test_no_text_steers_the_terminal": ("command3-",)},
    "tests/solvers/test_shapes.py": {"test_finer_spaces_lie_on_the_true_surface": ("tet10-bent rod", "tet10-sphere")},
    "tests/solvers/test_gaps.py": {"test_gradient_and_hessian_are_those_of_the_gap": ("surface of a ball",)},
}  # fmt: skip


def is_broad(item: pytest.Item) -> bool:
    """Whether a test waits for the slow ones."""
    file, _, test = item.nodeid.partition("::")
    name, _, case = test.partition("[")
    case = case.removesuffix("]") + "-"
    words = QUICK.get(file, {}).get(name)
    if words is not None and not any(word in case for word in words):
        return True
    return any(word in case for word in WAIT.get(file, {}).get(name, ()))
