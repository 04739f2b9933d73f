"""Which cases of broad tests are quick: one or a few of each kind. The others wait for `-m slow`.

A test is here where its cases take seconds together, and where the quick ones find what breaks all of them. A case
is quick if its id contains one of the words that stand here. What has no quick case is marked slow where it stands.
"""

from __future__ import annotations

import pytest

LAWS = ("small", "corotational", "neo_hookean", "st_venant_kirchhoff")  # and one that has constants of its own
STEPS = ("trapezoidal", "bdf2", "central_differences")  # one step with velocities, several steps, explicit

QUICK: dict[str, dict[str, tuple[str, ...]]] = {
    "tests/interpreter/test_stated_time_step_errors.py": {
        "test_the_time_step_error_of_creep_holds_with_outputs_closer_than_the_step": ("0.5-, times",),
    },
    "tests/solvers/test_time_step_errors.py": {
        "test_the_estimated_error_of_a_step_is_its_error": ("0-",),
    },
    "tests/laws/test_scales_of_loads.py": {
        "test_a_bar_at_every_scale": ("hex8 (1000", "hex8 finite (1e-09", "hex20 mixed (1.0", "beam"),
    },
    "tests/interpreter/test_varying_constants_in_laws.py": {
        "test_they_are_checked_or_refused": ("-plain-", "biphasic_active", "active_viscous"),
    },
    "tests/interpreter/test_centrifugal.py": {
        "test_an_amplitude_is_the_same_for_solver_and_check": ("small",),
    },
    "tests/interpreter/test_time_step_of_metrics.py": {
        "test_an_axial_vibration_is_not_judged_by_the_lateral_one": ("size = 5 mm)-bdf2", "20)-trapezoidal"),
    },
    "tests/interpreter/test_rigid_contact_scenes.py": {
        "test_nor_is_one_that_comes_to_lie_in_its_plane": ("body0", "body3", "solid"),
    },
    "tests/interpreter/test_deck_scopes.py": {
        "test_supports_and_forces_act_on_the_nodes_of_their_scopes": ("0", "1", "2"),
    },
    "tests/interpreter/test_surface_stress.py": {
        "test_uniform_stress_contradicts_no_face": ("1-", "2-"),
        "test_narrow_patches_are_said_with_the_right_number": ("0-", "2-"),
    },
    "tests/solvers/test_critical_step.py": {
        "test_steps_are_stable_below_the_computed_edge_and_not_above": (
            "tet4 corotational even", "springs", "hex8 finite",
        ),
    },
    "tests/interpreter/test_axisymmetric.py": {
        "test_linear_answers_are_those_of_scikit_fem": ("quad8",),
        "test_pressures_around_an_axis_are_those_of_scikit_fem": ("tri6-0.5",),
    },
    "tests/interpreter/test_elastic_foundation.py": {
        "test_a_block_sinks_by_pressure_over_stiffness": ("tet4", "tet10", "small, size", "finite, size"),
    },
    "tests/interpreter/test_compare_page.py": {
        "test_every_label_is_on_the_page_and_in_the_terminal": (
            "usual", "no analysis", "two scenes", "asking", "far below",
        ),
    },
    "tests/interpreter/test_environment.py": {
        "test_streams_that_are_closed": ("arguments0",),
    },
    "tests/interpreter/test_homogeneous.py": {
        "test_round_bodies_have_the_force_of_their_section": ("tube",),
        "test_states_of_stretch_are_those_of_one_mesh": ("confined",),
    },
    "tests/interpreter/test_line_loads.py": {
        "test_nodes_take_what_halving_without_faces_finds": ("tet4", "hex8"),
    },
    "tests/interpreter/test_mass_spring.py": {
        "test_the_sagging_beam": ("hex8",),
    },
    "tests/interpreter/test_metrics_surfaces.py": {
        "test_concentric_spheres_are_the_difference_of_their_radii_apart": ("nearest",),
    },
    "tests/interpreter/test_plane.py": {
        "test_a_point_force_is_one_of_the_plane": ("quad9",),
        "test_stress_does_not_know_the_thickness": ("quad4",),
    },
    "tests/interpreter/test_regions.py": {
        "test_layers_behind_one_another_lengthen_by_their_own_moduli": ("hex8", "hex20"),
        "test_the_same_in_finite_strain": ("mixed", "tet4"),
    },
    "tests/interpreter/test_self_converged.py": {
        "test_a_pressed_column": ("methods1",),
    },
    "tests/interpreter/test_stretches.py": {
        "test_shares_of_cross_sections": ("shape0-", "shape1-", "shape2-", "shape5-"),
    },
    "tests/interpreter/test_geometric_supports.py": {
        "test_shares_of_a_file_are_those_of_closed_forms": ("tet4",),
    },
    "tests/interpreter/test_force_verification.py": {
        "test_an_answer_that_is_none_is_refused": ("hex_small", "ten_small"),
        "test_no_door_lets_what_is_no_number_in": ("rest-",),
    },
    "tests/grammar/test_extremes.py": {
        "test_what_is_long_and_wrong_is_refused_briefly": ("numbers", "broken", "quotes", "bracket", "equal"),
        "test_what_is_too_deep_is_refused": ("minus", "bracket"),
    },
    "tests/references/test_porous_theories.py": {
        "test_a_ramp_against_finite_volumes": ("False-both", "True-held"),
    },
    "tests/solvers/test_independent_forces.py": {
        "test_forces_and_volumes_with_pressures": (*LAWS, "0.3-ogden"),
        "test_forces_are_the_slope_of_an_energy_written_anew": (*LAWS, "ogden"),
    },
    "tests/solvers/test_deformable_contact.py": {
        "test_derivatives": ("False-tet4", "True-hex8", "True-tet10"),
    },
    "tests/solvers/test_combined.py": {
        "test_volume_is_the_closed_form_but_for_what_facets_miss": ("lens-", "in boxes-"),
        "test_what_they_hold_is_what_their_parts_say": ("corner taken-", "a lens-"),
    },
    "tests/solvers/test_load_amplitudes.py": {
        "test_a_short_pulse_is_its_impulse": STEPS,
        "test_order_under_a_pulse_that_begins_and_ends_between_steps": STEPS,
        "test_order_under_ramps_whose_kinks_are_between_steps": STEPS,
        "test_sine_below_and_above_the_frequency_of_an_oscillator": ("trapezoidal", "bdf2", "central_differences"),
    },
    "tests/solvers/test_damping_state.py": {
        "test_a_body_without_forces_flies_on": ("bdf2",),
    },
    "tests/solvers/test_dynamics.py": {
        "test_amplification_and_period": STEPS,
        "test_linear_momentum_of_a_free_body": ("bdf2", "central_differences"),
    },
    "tests/solvers/test_dynamics_balance.py": {
        "test_a_cantilever_over_six_decades_of_steps": ("central_differences",),
        "test_steps_over_six_decades_are_right_or_said_to_be_wrong": ("central_differences",),
        "test_linear_vibrations_gain_nothing_at_any_step": ("trapezoidal", "bdf2", "implicit_euler"),
    },
    "tests/solvers/test_lagged_tangent.py": {
        "test_trajectories_are_those_of_newton": STEPS,
    },
    "tests/solvers/test_dynamics_solids.py": {
        "test_every_mode_of_a_solid_moves_as_one_oscillator": STEPS,
        "test_momentum_of_a_free_spinning_block": STEPS,
        "test_step_load_on_a_clamped_bar": ("bdf2",),
    },
    "tests/solvers/test_elastic.py": {
        "test_derivatives_at_unit_scale": (*LAWS, "1-ogden", "1-mooney"),
        "test_kernels_against_einsum": (*LAWS, "ogden"),
        "test_numbers_of_invariants_do_what_tensors_do": ("tet4", "hex8", "0.3-neo_hookean-hex27"),
    },
    "tests/solvers/test_ellipticity.py": {
        "test_what_is_lost_is_what_some_direction_loses": ("kirchhoff-0.3", "hookean-0.45"),
    },
    "tests/solvers/test_laws.py": {
        "test_a_bent_bar_is_that_of_felupe": ("mooney_rivlin", "ogden", "gent"),
        "test_derivatives_with_every_energy_of_the_volume": ("ogden", "mooney"),
    },
    "tests/solvers/test_material_point.py": {
        "test_states_of_stretch_are_those_of_closed_forms": ("-0.49",),
    },
    "tests/solvers/test_strain_measures.py": {
        "test_what_is_lost_never_comes_back_and_the_rest_is_stored": ("green", "small"),
    },
    "tests/solvers/test_mesh.py": {
        "test_other_cells_fill_the_same_body": ("tet10", "hex8", "hex20"),
    },
    "tests/solvers/test_mesh_distort.py": {
        "test_patch_test": ("0.1-hex27", "0.001-hex20", "hex8", "tet"),
        "test_the_worst_cell_has_the_quality_that_was_asked_for": ("0.2-hex8-Box", "0.2-tet10-Cylinder"),
    },
    "tests/solvers/test_plane_stress.py": {
        "test_derivatives": (*LAWS, "mooney"),
        "test_the_check_finds_the_same_by_halving": (*LAWS, "ogden"),
    },
    "tests/solvers/test_polygonal_shapes.py": {
        "test_flat_sided_bodies_have_their_volume_and_sound_cells": ("angle-",),
    },
    "tests/solvers/test_recovery.py": {
        "test_every_disturbance_of_tetrahedra": ("spun", "flattened"),
        "test_other_elements": ("few-inverted-tet10", "flattened-hex8"),
    },
    "tests/solvers/test_mesh_refinement.py": {
        "test_it_is_the_same_body_and_holds_the_coarse_space": ("box", "tet4", "hex8", "hex20", "hex27"),
    },
    "tests/solvers/test_axisymmetric.py": {
        "test_derivatives_of_a_pressure_on_rings": ("hex8",),
        "test_derivatives_of_every_law_with_one_mean_in_each_cell": ("neo_hookean_isochoric", "kirchhoff"),
        "test_derivatives_of_the_energy": ("finite",),
        "test_derivatives_with_pressures": ("finite",),
        "test_forces_with_pressures_found_again": ("finite-hex8", "small-hex27"),
    },
    "tests/solvers/test_rod_motion.py": {
        "test_momenta_of_a_free_rod_that_spins_and_bends": ("midpoint", "generalized_alpha"),
    },
    "tests/solvers/test_rod_tendons.py": {
        "test_the_tangent_in_motion_is_the_derivative_of_the_forces": ("MovingGuidedTendon",),
    },
    "tests/solvers/test_solids.py": {
        "test_scrambled_cube_recovers": ("0",),
    },
    "tests/solvers/test_statics.py": {
        "test_both_ways_find_the_same_equilibrium": ("corotational", "neo_hookean-True"),
        "test_what_is_not_a_number_is_never_returned": ("broken1-0.001-True", "broken2-0.001-True", "-1.0"),
        "test_a_tiny_load_gives_the_linear_answer": ("0.001", "1e-09-small"),
        "test_a_hopeless_problem_is_refused_with_its_history": ("0.25",),
    },
    "tests/solvers/test_viscoelastic.py": {
        "test_the_loss_tangent_is_that_of_the_series_to_second_order": ("0.1-",),
    },
    "tests/test_architecture.py": {
        "test_checking_a_scene_imports_no_numerics_and_looks_for_no_data": ("check",),
        "test_commands_that_compute_nothing_import_no_numerics": ("command2", "command3", "command8"),
    },
    "tests/interpreter/test_reported_loads.py": {
        "test_force_and_moment_of_loads_on_parts_of_facets": ("tet4",),
    },
    "tests/interpreter/test_frequency.py": {
        "test_solids_have_those_of_another_code_on_the_same_mesh": ("hex8", "tet4"),
    },
    "tests/interpreter/test_report_shapes.py": {
        "test_of_many_shapes_a_few_are_shown_at_first_and_the_caption_says_how_many": ("24",),
    },
    "tests/solvers/test_mixed.py": {
        "test_linear_pressures_converge": ("tet10",),
        "test_the_limit_is_reached_continuously": ("finite",),
        "test_no_locking_in_a_thick_sphere": ("tet10", "mean_dilatation"),
    },
    "tests/solvers/test_principal_axes_law.py": {
        "test_a_state_by_numbers_is_that_of_arrays": ("ogden", "neo_hookean-pulled-"),
        "test_a_law_in_principal_axes_is_that_of_tensors": ("ogden", "mooney"),
    },
    "tests/solvers/test_mesh_cuts.py": {
        "test_planes_and_circles_in_cylinders_are_met": ("tet4", "hex8", "5-tet10"),
    },
    "tests/solvers/test_loads.py": {
        "test_gravity_is_the_weight_at_the_centroid": ("tet4", "hex8", "consistent-tet10-cyl"),
    },
    "tests/solvers/test_shapes.py": {
        "test_volume_converges_with_the_order_of_the_facets": ("tet4", "hex8", "tet10-4.0-sphere", "hex20-4.0-tube"),
    },
    "tests/solvers/test_integration_options.py": {
        "test_nearly_incompressible_beams_take_a_dozen_steps": ("0.499-",),
    },
    "tests/solvers/test_inner_borders.py": {
        "test_what_lies_within_a_border_has_its_volume": ("tet4", "hex8", "tet10-sphere"),
    },
}  # fmt: skip

# the other way round: of tests with many quick cases, those whose id has one of these words wait
WAIT: dict[str, dict[str, tuple[str, ...]]] = {
    "tests/interpreter/test_codes.py": {
        "test_examples": (
            "W318", "W361", "W362", "W659", "W388", "W630", "E631", "E520", "W371", "W352", "W368", "W315",
            # each of them has a golden message as well, which is quick
            "W384", "W393", "E632", "E412", "W305", "W337", "W394", "W389", "W345", "W356", "W367", "W314",
            "E410", "E630", "W401", "W419", "W639",
            "E325", "E337", "W379", "W704", "E326", "E555", "W381", "E430", "W380", "W306", "W351", "W349", "W375",
            "E383", "W387", "W357", "W319", "W341", "W324", "W336", "E324", "W391", "W613", "W353",
        ),
    },
    "tests/interpreter/test_diagnostics.py": {
        "test_golden": (
            "mesh-dangling", "pores-w393", "level-e412", "point-force-looked-at", "pores-w394", "reduced-sweep-range",
            "dynamic-halved", "dynamic-integrator-loss", "contact-rigid-through", "tolerance-loose-run",
            "dynamic-unresolved", "contact-loose-piece", "results-factor", "stress-beside", "reduced-residual",
            "load-border-along-surface", "support-thin-skin", "contact-cut-in", "line-load-looked-at",
            "fem-start-fails", "contact-coarse", "contact-wide-barrier", "dynamic-step-of-metric", "dynamic-unbalanced",
            "graded-field-outside", "load-less-than-asked", "stress-under-narrow-patch", "stress-without-limit",
            "symmetric-point-force-across", "tendon-pressed", "varying-behind-one-another", "varying-too-fine",
            "viscous-w368",
        ),
    },
    "tests/laws/test_varying_within_cells.py": {
        "test_one_pressure_in_each_cell_has_the_harmonic_mean": ("1-", "2-", "3-"),
        "test_plane_cells_are_integrated_too": ("1-",),
    },
    "tests/laws/test_macneal_harder.py": {
        "test_the_patch_of_solids": ("hex20, strain = small", "hex27, strain = small"),
    },
    "tests/interpreter/test_surface_stress.py": {
        "test_lines_and_volumes_that_reach_the_patch_are_said": ("volume(",),
    },
    "tests/interpreter/test_deformable_contact_reports.py": {"test_what_a_mirror_image_does_a_plane_does": ("quad8",)},
    "tests/solvers/test_vtk_files.py": {"test_broken_files_of_vtk_are_refused": ("legacy",)},
    "tests/interpreter/test_fuzz_corpus.py": {"test_what_broke_a_promise_keeps_it": ("comparison-long", "sweep-long")},
    "tests/interpreter/test_hostile_texts.py": {"test_no_text_steers_the_terminal": ("command3-",)},
    "tests/solvers/test_shapes.py": {"test_finer_spaces_lie_on_the_true_surface": ("tet10-bent rod", "tet10-sphere")},
    "tests/interpreter/test_compare_page.py": {"test_every_page_is_whole_and_needs_nothing_else": ("200 points",)},
    "tests/solvers/test_penetration_depth.py": {
        "test_nothing_is_deeper_on_a_dense_lattice": ("9-", "6-", "8-", "4-")
    },
    "tests/solvers/test_signed_distance.py": {"test_gradient_and_hessian_are_those_of_the_gap": ("surface of a ball",)},
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
