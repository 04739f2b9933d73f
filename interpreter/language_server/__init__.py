"""Language server: answers an editor's requests about scenes (Language Server Protocol)."""
