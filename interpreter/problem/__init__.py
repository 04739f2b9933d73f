"""Cases (one body with its supports, loads and contacts), theory problems, geometry shared by models.

    body_case, solution                      the case that a model solves; the results of a model or reference
    cross_section_coverage                   selected part of each cross-section along an axis
    box_and_cylinder_faces                   faces that supports and loads select
    probe_points, probe_domains              points at which results are evaluated
    surface_selection/                       selected parts of surfaces, with exact integrals
    conforming_mesh                          positions at which meshes need nodes so that selections are met
    theories/                                the problems that theories solve for a case, and their results
    *_limits, symmetry_planes                errors about materials and symmetry planes

Imports packages up to the vocabulary, but no models.
"""
