"""From the text of a scene to a scene of typed values in SI: names, units, expressions, calls, overrides.

    units, expressions, conditions   numbers with dimensions, and selections of points
    sources, scope, parameters       texts, names, and what they stand for
    schema, aliases                  how a class tells what its word takes; what other programs call it
    calls, sweeps, expectations      what is written, bound to fields
    compile                          all of it, into a `scene.Scene`
    messages, message_limit          what is said of a place in it, and how much at most

The vocabulary is handed in (`schema.Vocabulary`): this room imports `results` alone, and the grammar. To add a form of
field: `schema.Form`, how `calls` binds it, and what it `expected` in messages.
"""
