"""One body of a scene with all that acts on it (`case`), and geometry that every model and report shares.

    case, stations, view     the case that a model solves, sections along an axis, what is known once it is solved
    points, parts/           where answers are looked at; parts of surfaces, integrated
    conforming               where meshes need nodes so that selections are met
    beam_theory, data, ...   prisms, measured data, small deflections

Imports rooms up to the vocabulary. No model is known here.
"""
