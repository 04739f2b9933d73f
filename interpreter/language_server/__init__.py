"""What an editor asks of a scene while it is written: the language server."""
