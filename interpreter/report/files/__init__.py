"""The report on disk: JSON, HTML, JUnit, files for ParaView."""
