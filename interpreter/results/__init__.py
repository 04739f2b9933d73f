"""What a run leaves, as plain values: `report` and its parts, and the files that are made of them.

Imports no other room. To add a part of the report: a dataclass in a file here, a field of `report.Report`, and the
contract's entry in its `to_json`.
"""
