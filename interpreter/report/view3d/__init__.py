"""Bodies in three dimensions: made small enough for a page, drawn without a script and with one."""
