"""Reduced-order models of finite element models: declaration, reduced space, training scenes and states, builder."""
