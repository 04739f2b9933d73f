"""Selected parts of surfaces with exact integrals, and load resultants on them.

gradient_intervals       bounds of a condition's levels and slopes over small triangles
facet_patches            positions of facets, and conditions on them
plane_clipping           flat triangles cut along planes
curved_triangle_parts    parts of triangles behind curved borders
selected_facets          whole and partly selected facets
facet_deviation          deviation of facets of a mesh file from the smooth surface
exact_surface            surfaces of shapes without a mesh
containment              inside of a shape, for surfaces of combined bodies
loaded_surface_part, load_resultants     loads on meshes, and their resultants
"""
