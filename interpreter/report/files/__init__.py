"""Files of a report: JSON, HTML, JUnit, and ParaView meshes."""
