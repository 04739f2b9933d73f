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
    "tests/interpreter/test_first_touch.py": {
        "test_a_rod_imports_nothing_while_its_clock_runs": NONE,
        "test_nothing_is_searched_for_among_modules_and_no_thread_waits_awake": ("None",),
    },
    "tests/interpreter/test_sandbox.py": {
        "test_checking_and_planning_open_nothing_but_the_scene_its_folder_and_softmark": NONE,
        "test_no_value_is_run": ("exec(1)", "HOME"),
    },
    "tests/interpreter/test_files_and_selections.py": {
        "test_studies_of_one_model_are_not_stopped_by_another": NONE,
        "test_a_selection_is_refused_only_where_it_misses_the_surface": ("cylinder",),
    },
    "tests/interpreter/test_turned.py": {"test_a_turn_that_cells_cannot_follow_is_no_answer": NONE},
    "tests/solvers/test_peers.py": {
        "test_neo_hookean_logarithmic_against_felupe": NONE,
        "test_neo_hookean_isochoric_against_felupe": NONE,
    },
    "tests/interpreter/test_made_once.py": {"test_a_comparison_compiles_each_variation_once": NONE},
    "tests/interpreter/test_fuzz_scenes.py": {"test_some_are_sound_and_every_constructor_occurs": NONE},
    "tests/grammar/test_extremes.py": {
        "test_what_is_long_and_right_is_parsed": NONE,
        "test_what_is_too_deep_is_refused": ("or", "a bound", "minus", "brackets"),
    },
    "tests/grammar/test_print.py": {
        "test_comments_anywhere_are_kept": NONE,
        "test_an_expression_survives_printing": NONE,
    },
    "tests/test_architecture.py": {
        "test_kernels_on_disk_are_loaded_without_the_compiler": NONE,
        "test_commands_that_compute_nothing_import_no_numerics": ("command2", "command3", "command8"),
        "test_checking_a_scene_imports_no_numerics_and_looks_for_no_data": ("check",),
    },
    "tests/solvers/test_rod_tendons.py": {
        "test_the_tangent_in_motion_is_the_derivative_of_the_forces": ("TurnedGuides",),
        "test_a_free_rod_is_not_moved_by_its_tendon": NONE,
    },
    "tests/solvers/test_elements.py": {
        "test_points_on_faces_edges_and_corners_have_the_values_that_any_cell_there_gives": NONE,
    },
    "tests/interpreter/test_viscous.py": {
        "test_elastic_bodies_load_nothing_of_what_remembers": NONE,
        "test_energy_of_a_law_that_is_not_convex_is_said_to_be_unknown_in_a_motion": NONE,
    },
    "tests/interpreter/test_study_review.py": {
        "test_warnings_belong_to_the_models_that_they_are_about": NONE,
        "test_what_only_refines_is_one_problem": NONE,
        "test_a_model_that_is_measured_against_is_a_truth_too": NONE,
    },
    "tests/interpreter/test_authors_mesh.py": {"test_tip": NONE, "test_distance_from_the_scan": NONE},
    "tests/interpreter/test_cli_run.py": {"test_interruption_keeps_what_was_finished": NONE},
    "tests/interpreter/test_compare_page.py": {
        "test_in_chromium": ("usual",),
        "test_every_label_is_on_the_page_and_in_the_terminal": (
            "usual", "no analysis", "two scenes", "asking", "far below",
        ),
    },
    "tests/interpreter/test_compile.py": {"test_ten_thousand_lines": NONE},
    "tests/interpreter/test_converged_beam.py": {"test_tip_within_half_a_per_cent_of_the_length": ("hex8",)},
    "tests/interpreter/test_fuzz_corpus.py": {"test_reading_a_scene_does_nothing_but_read": NONE},
    "tests/interpreter/test_environment.py": {
        "test_a_reader_that_goes_away": NONE,
        "test_terminals_that_lack_characters": NONE,
        "test_a_journal_that_does_not_fit": NONE,
        "test_homes_caches_and_folders_that_are_not_there": ("/dev/null",),
        "test_streams_that_are_closed": ("arguments0",),
    },
    "tests/interpreter/test_incompressible.py": {
        "test_the_limit_in_a_scene": ("0.4999-", "0.5"),
        "test_forms_agree_and_say_nothing_of_locking": NONE,
    },
    "tests/interpreter/test_levers.py": {
        "test_a_capped_state_has_its_metrics_and_its_residual": NONE,
        "test_levers_that_cost_no_accuracy": NONE,
        "test_what_simulators_do_in_a_step_is_no_solution": NONE,
        "test_a_start_saves_steps_and_is_charged": NONE,
    },
    "tests/interpreter/test_large_stretch.py": {
        "test_three_times_its_length_in_every_formulation": ("0.4999-equibiaxial",),
        "test_a_gripped_strip_at_three_times_its_length": NONE,
    },
    "tests/interpreter/test_measured.py": {"test_with_the_printed_modulus_it_is_six_millimetres_away": NONE},
    "tests/interpreter/test_motion_scenes.py": {
        "test_overshoot": ("sudden",),
        "test_what_comes_to_rest_rests_where_the_static_analysis_is": ("generalized_alpha",),
        "test_a_pulse_between_two_steps_moves_the_body": ("trapezoidal", "bdf2"),
    },
    "tests/interpreter/test_parts.py": {
        "test_areas_on_flat_faces": ("tet4",),
        "test_random_selections_are_those_of_samples_and_of_the_watchdog": ("0", "2", "7"),
        "test_selections_along_a_sphere_take_all_of_it": ("hex8-2", "tet4-2"),
        "test_cut_by_a_plane_the_sphere_has_the_area_of_its_facets": ("tet4", "hex8"),
        "test_bands_and_segments_on_a_cylinder": ("tet10",),
        "test_a_border_along_the_surface_says_what_is_open": NONE,
    },
    "tests/interpreter/test_axisymmetric.py": {
        "test_linear_answers_are_those_of_scikit_fem": ("quad8",),
        "test_pressures_around_an_axis_are_those_of_scikit_fem": ("tri6-0.5",),
    },
    "tests/interpreter/test_curves.py": {"test_a_scene_without_curves_reads_and_imports_nothing_of_them": NONE},
    "tests/interpreter/test_far_stress.py": {"test_on_a_whole_surface_it_makes_a_uniform_stress": NONE},
    "tests/interpreter/test_graded.py": {"test_a_scene_without_any_loads_none_of_this": NONE},
    "tests/interpreter/test_line_loads.py": {
        "test_nodes_take_what_halving_without_faces_finds": ("tet4", "hex8", "oblique-hex20"),
    },
    "tests/interpreter/test_homogeneous.py": {
        "test_states_of_stretch_are_those_of_one_mesh": ("confined",),
        "test_a_force_may_pull": NONE,
        "test_measures_of_strain_are_those_of_finite_elements": NONE,
        "test_round_bodies_have_the_force_of_their_section": ("tube",),
        "test_grips_that_hold_a_width_leave_no_stated_error": NONE,
        "test_a_scene_of_one_material_point_loads_no_mesh": NONE,
    },
    "tests/solvers/test_material_point.py": {
        "test_states_of_stretch_are_those_of_closed_forms": ("-0.49",),
    },
    "tests/solvers/test_ellipticity.py": {
        "test_what_is_lost_is_what_some_direction_loses": ("kirchhoff-0.3", "hookean-0.45"),
    },
    "tests/interpreter/test_library.py": {"test_the_list_of_the_library_needs_no_arrays": NONE},
    "tests/interpreter/test_networks.py": {"test_a_scene_without_networks_imports_nothing_for_them": NONE},
    "tests/interpreter/test_values.py": {"test_a_scene_without_values_imports_nothing_of_them": NONE},
    "tests/interpreter/test_tendons.py": {"test_between_guides_a_tendon_is_straight": NONE},
    "tests/interpreter/test_moving_beams.py": {
        "test_it_comes_to_rest_where_the_static_analysis_is": NONE,
        "test_a_free_bar_flies_on_and_turns_about_its_centre": NONE,
    },
    "tests/interpreter/test_moving_networks.py": {
        "test_it_moves_alike_seen_from_another_side": NONE,
        "test_momenta_of_a_free_star": NONE,
    },
    "tests/interpreter/test_groups.py": {"test_a_scene_without_groups_imports_nothing_for_them": NONE},
    "tests/interpreter/test_regions.py": {"test_a_scene_without_regions_loads_none_of_this": NONE},
    "tests/interpreter/test_plane.py": {
        "test_stress_does_not_know_the_thickness": ("quad4",),
        "test_a_point_force_is_one_of_the_plane": ("quad9",),
        "test_linear_answers_are_those_of_scikit_fem": (
            "quad9-plane_strain", "quad4-plane_stress", "tri6-plane_strain",
        ),
        "test_a_pulled_strip_in_plane_stress": ("neo_hookean_isochoric", "st_venant_kirchhoff"),
    },
    "tests/interpreter/test_recovery_scenes.py": {"test_the_same_equilibrium_or_none": ("scrambled", "inverted")},
    "tests/interpreter/test_reduced_models.py": {"test_a_training_without_equilibrium_is_told": NONE},
    "tests/interpreter/test_report_browser.py": {
        "test_in_chromium": ("1280",),
        "test_shapes_in_chromium": ("500",),
    },
    "tests/interpreter/test_self_converged.py": {
        "test_the_report_says_what_it_is_worth": NONE,
        "test_metrics_carry_its_uncertainty": NONE,
        "test_a_sheared_column": ("methods2-0.4999",),
        "test_a_hanging_column_is_round": NONE,
        "test_a_short_round_beam_is_that_of_another_method": NONE,
        "test_a_pressed_column": ("methods1",),
    },
    "tests/interpreter/test_stated.py": {
        "test_no_model_is_silent_about_an_error": NONE,
        "test_the_error_in_a_norm_of_strains_is_stated_in_it": NONE,
    },
    "tests/interpreter/test_stated_finer.py": {
        "test_the_displacement_of_a_point_has_one_in_metres": NONE,
        "test_they_hold_the_true_ones_and_shrink_with_the_mesh": ("tet4",),
        "test_elements_that_lock_have_one_that_holds_or_none": ("hex8",),
        "test_what_means_of_the_volume_leave_out_is_no_error_of_a_strain": NONE,
        "test_a_finer_space_is_solved_in_what_bends_too": NONE,
        "test_a_mesh_from_a_file_has_one": ("tet4", "tet10", "hex8"),
        "test_a_cylinder_of_hexahedra_states_what_its_flat_facets_miss": NONE,
    },
    "tests/interpreter/test_stretches.py": {
        "test_shares_of_cross_sections": tuple(f"shape{i}-" for i in range(7)),
        "test_shares_of_oblique_sections_against_points": ("0", "3", "5"),
    },
    "tests/interpreter/test_study_clock.py": {
        "test_what_is_done_already_is_not_done_again": NONE,
        "test_a_run_beside_a_busy_loop_is_flagged": NONE,
        "test_rounds_are_interleaved_and_every_run_is_a_process_of_its_own": NONE,
        "test_phases_of_a_solid_are_mostly_tangents_and_factors": NONE,
    },
    "tests/interpreter/test_study_cli.py": {
        "test_a_variation_in_error_is_a_failed_point_and_status_3": NONE,
        "test_python_keeps_a_folder_that_is_named": NONE,
        "test_a_folder_with_finished_tasks_is_refused_unless_told": NONE,
        "test_an_unfinished_journal_is_gone_on_with": NONE,
        "test_what_has_changed_between_two_results": NONE,
        "test_a_model_is_timed_once_the_second_time_from_the_journal": NONE,
    },
    "tests/interpreter/test_study_pool.py": {
        "test_a_killed_worker_of_ours": NONE,
        "test_one_worker_and_two_find_the_same_as_this_process": NONE,
        "test_a_cluster_finds_the_same": NONE,
    },
    "tests/interpreter/test_supports_as_geometry.py": {
        "test_scenes_of_the_library_get_the_meshes_that_they_had": NONE,
        "test_narrow_and_wide_hold_the_conforming_answer_between_them": ("0", "1"),
    },
    "tests/interpreter/test_watchdog.py": {
        "test_loads_on_surfaces_and_imposed_motion_are_checked": NONE,
        "test_solids_with_pressures_are_checked_again": NONE,
    },
    "tests/solvers/test_polygonal_shapes.py": {
        "test_turned_bodies_are_met_with_the_order_of_the_facets": ("tip-", "tube-"),
        "test_the_whole_surface_is_closed_and_of_its_area": ("cone-",),
        "test_flat_sided_bodies_have_their_volume_and_sound_cells": ("angle-",),
        "test_a_band_of_a_cone_is_a_frustum": NONE,
    },
    "tests/solvers/test_checks.py": {
        "test_forces_and_volumes_with_pressures": (*LAWS, "0.3-ogden"),
        "test_forces_are_the_slope_of_an_energy_written_anew": (*LAWS, "ogden"),
    },
    "tests/solvers/test_elastic.py": {
        "test_derivatives_at_unit_scale": (*LAWS, "1-ogden", "1-mooney"),
        "test_kernels_against_einsum": (*LAWS, "ogden"),
    },
    "tests/solvers/test_plane_stress.py": {
        "test_derivatives": (*LAWS, "mooney"),
        "test_the_check_finds_the_same_by_halving": (*LAWS, "ogden"),
    },
    "tests/solvers/test_laws.py": {
        "test_a_bent_bar_is_that_of_felupe": ("mooney_rivlin", "ogden", "gent"),
        "test_derivatives_with_every_energy_of_the_volume": ("ogden", "mooney"),
    },
    "tests/solvers/test_combined.py": {
        "test_volume_is_the_closed_form_but_for_what_facets_miss": ("lens-", "in boxes-"),
        "test_what_they_hold_is_what_their_parts_say": ("corner taken-", "a lens-"),
    },
    "tests/solvers/test_damping_state.py": {
        "test_the_first_overshoot_of_a_nearly_incompressible_body_does_not_hang_on_the_step": ("tet10-bdf2",),
        "test_what_is_stiff_does_not_brake_what_is_slow": ("bdf2",),
        "test_a_body_without_forces_flies_on": ("trapezoidal", "bdf2", "newmark"),
    },
    "tests/solvers/test_dynamics.py": {
        "test_a_support_that_moves": ("implicit_euler", "central_differences"),
        "test_rayleigh_damping_ratio": ("bdf2",),
        "test_amplification_and_period": STEPS,
    },
    "tests/solvers/test_dynamics_balance.py": {
        "test_steps_over_six_decades_are_right_or_said_to_be_wrong": ("bdf2", "central_differences"),
        "test_a_cantilever_over_six_decades_of_steps": STEPS,
        "test_a_stiff_body_that_spins_too_fast_for_the_step_never_comes_out_as_converged_with_a_gain": (
            "newmark", "midpoint", "bdf2",
        ),
    },
    "tests/solvers/test_dynamics_lagged.py": {
        "test_with_damping_moving_supports_and_courses_of_loads": ("generalized_alpha",),
    },
    "tests/solvers/test_dynamics_solids.py": {
        "test_step_load_on_a_clamped_bar": STEPS,
        "test_every_mode_of_a_solid_moves_as_one_oscillator": STEPS,
    },
    "tests/solvers/test_folds.py": {"test_none_is_missed_and_none_is_blamed": ("tet10-60", "hex8-60")},
    "tests/solvers/test_jit.py": {
        "test_an_edited_callee_is_never_answered_from_the_cache": NONE,
        "test_a_kernel_that_was_spoilt_is_compiled_anew": ("cut off",),
        "test_a_source_that_is_edited_while_a_process_starts": NONE,
        "test_a_folder_in_the_place_of_a_kernel_is_done_without": NONE,
        "test_a_kernel_elsewhere_whose_constant_is_edited": NONE,
        "test_a_kernel_under_the_name_of_another_is_not_taken": NONE,
    },
    "tests/solvers/test_mesh.py": {"test_other_cells_fill_the_same_body": ("tet10", "hex8", "hex20")},
    "tests/solvers/test_mesh_distort.py": {
        "test_the_worst_cell_has_the_quality_that_was_asked_for": ("0.2-",),
    },
    "tests/solvers/test_orders_solids.py": {
        "test_order_of_a_manufactured_solution": ("small", "hex8-full"),
        "test_straight_edges_limit_quadratic_tetrahedra": NONE,
    },
    "tests/solvers/test_orders_time.py": {
        "test_order_of_a_linear_vibration": STEPS,
        "test_order_of_a_nonlinear_problem": STEPS,
    },
    "tests/solvers/test_recovery.py": {
        "test_scrambled_tetrahedra_find_back": ("neo_hookean-1.0", "corotational-10.0"),
        "test_st_venant_kirchhoff_finds_back_or_names_its_inverted_cells": NONE,
        "test_springs_say_that_they_are_folded": NONE,
    },
    "tests/solvers/test_refine.py": {
        "test_it_is_the_same_body_and_holds_the_coarse_space": ("box", "tet4", "hex8", "hex20", "hex27"),
    },
    "tests/solvers/test_revolved.py": {
        "test_derivatives_of_the_energy": ("finite",),
        "test_derivatives_of_every_law_with_one_mean_in_each_cell": ("neo_hookean_isochoric", "kirchhoff"),
        "test_derivatives_with_pressures": ("finite",),
        "test_forces_with_pressures_found_again": ("finite-hex8", "small-hex27"),
        "test_derivatives_of_a_pressure_on_rings": ("hex8",),
    },
    "tests/solvers/test_rod_motion.py": {
        "test_order_in_time": ("midpoint", "bdf2"),
        "test_momenta_of_a_free_rod_that_spins_and_bends": ("midpoint", "generalized_alpha"),
    },
    "tests/solvers/test_statics.py": {"test_what_is_not_a_number_is_never_returned": ("0.001-True", "-1.0")},
    "tests/solvers/test_viscous.py": {
        "test_a_mass_on_zeners_spring_in_every_integrator": ("trapezoidal",),
        "test_the_loss_tangent_is_that_of_the_series_to_second_order": ("0.1-",),
    },
    "tests/interpreter/test_viscous_beams.py": {
        "test_a_zener_mass_swings_with_its_damped_period": NONE,
    },
    "tests/interpreter/test_beds.py": {
        "test_a_block_sinks_by_pressure_over_stiffness": ("tet4", "tet10", "small, size", "finite, size"),
    },
    "tests/interpreter/test_metrics_shown.py": {
        "test_compare_shows_metrics_that_need_no_reference": ("text1",),
    },
    "tests/solvers/test_linear_methods.py": {
        "test_pardiso_without_its_library_gives_way": ("-True",),
    },
}  # fmt: skip


def is_broad(item: pytest.Item) -> bool:
    """Whether a test waits for the slow ones."""
    file, _, test = item.nodeid.partition("::")
    name, _, case = test.partition("[")
    words = QUICK.get(file, {}).get(name)
    return words is not None and not any(word in case.removesuffix("]") + "-" for word in words)
