"""Cases (one body of a scene with its supports, loads and contacts), theory problems, and geometry shared by models.

    body_case, solution                      the case that a model solves; the results of a model or reference
    axial_selection, body_faces              selections of sections along an axis, and of faces
    probe_points, probe_domains              points at which answers are evaluated
    surface_selection/                       selected parts of surfaces, with exact integrals
    conforming_mesh                          places where meshes need nodes so that selections are met
    *_theory, theory_problems                from a case to the problem of a theory
    *_limits, symmetry_planes                errors of materials and symmetry planes

Imports packages up to the vocabulary, but no models.
"""
