"""Results of a run as plain values: the `Report` with its parts, and the files written from it.

This package imports no other package. To add a part of the report: write a dataclass in a file here, add a field to
`run_report.Report`, and add the entry to `Report.to_json`.
"""
