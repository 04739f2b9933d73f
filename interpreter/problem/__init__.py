"""Cases (one body of a scene with its supports, loads and contacts), theory problems, and geometry shared by models.

    body_case, solution                      the case that a model solves; the results of a model or reference
    cross_section_coverage                   selected part of each section along an axis
    box_and_cylinder_faces                   faces that supports and loads select
    probe_points, probe_domains              points at which answers are evaluated
    surface_selection/                       selected parts of surfaces, with exact integrals
    conforming_mesh                          places where meshes need nodes so that selections are met
    *_theory_setup, theory_dispatch          from a case to the problem of a theory
    *_limits, symmetry_planes                errors of materials and symmetry planes

Imports packages up to the vocabulary, but no models.
"""
