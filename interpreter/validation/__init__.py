"""Validation: the vocabulary of scenes, and all errors and warnings that are reported before anything is built.

    constructor_registry   all tables of constructors
    scene_loader           conversion of a text to a scene and its diagnostics
    scene_checks           errors of a compiled scene; `value_warnings` has the warnings
    *_checks               errors of one topic: contact, states, curves, references, sweeps, ...
    plugin_loader          words of plugins

Imports packages up to the models, of which only the declarations. To add a check: write a function that yields
diagnostics, and add a line in `scene_checks`.
"""
