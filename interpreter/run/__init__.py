"""The pipeline: from a scene to its report, and where that happened. Imports rooms up to the evidence."""
