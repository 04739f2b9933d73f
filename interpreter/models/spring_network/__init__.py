"""Networks of springs: `words` for scenes, `build` for arrays, `calibration` of their stiffness."""
