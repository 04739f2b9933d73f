"""Reduced models of finite elements: declaration, reduced space, training scenes and states, builder."""
