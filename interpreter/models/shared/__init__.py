"""Code shared by models: supports, loads, contacts, materials, dynamics, static results, capabilities."""
