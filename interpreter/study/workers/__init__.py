"""Worker processes that perform tasks, and the journal of finished tasks."""
