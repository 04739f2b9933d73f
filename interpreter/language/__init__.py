"""Compiler of the language: converts the text of a scene to typed values in SI units.

    units, expression_evaluation                        numbers with dimensions
    condition_syntax, coordinate_conditions             selections of points
    scene_sources, name_scope, parameter_evaluation, parameter_overrides    texts, names and their values
    field_schema, foreign_aliases, foreign_words        fields of constructors, and names from other programs
    call_binding, field_parsers, sweep_values, expectation_conditions       arguments of calls bound to fields
    profile_syntax, spatial_profiles, interval_arithmetic                   constants that vary in space
    compiler, compiled_scene, scene_states              a compiled `Scene`, and the scene in one of its states
    message_builder, message_limit, number_formatting   diagnostics, their maximum number, numbers in messages

Callers pass the vocabulary (`field_schema.Vocabulary`); this package imports only `results` and the grammar. To add a
form of field: add it to `field_schema.Form`, bind it in `call_binding`, and describe it in `Field.expected`.
"""
