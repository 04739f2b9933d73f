"""Parts of surfaces that conditions select, integrated exactly, and what loads on them come to.

`bounds` bounds a condition's levels and their slopes over small triangles, `patches` says where a surface lies, `flat`
cuts flat triangles along planes, `curved` follows curved borders, `taken` puts the parts together, `deviation` knows by
how much facets of a file miss the smooth surface that they stand for, `true` the surfaces of shapes themselves, and
`within` what lies within them, which tells what a body that is made of two has of the surface of each.
"""
