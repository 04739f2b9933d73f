"""Models of spring networks: declaration, builder and calibration of their stiffness."""
