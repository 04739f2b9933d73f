"""Model of a single material point in place of a body: declaration, imposed deformation and builder."""
