"""Contact with rigid bodies and between deformable bodies: gaps, barriers, friction, ties and free rigid bodies."""
