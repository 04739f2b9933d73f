"""The beam with six degrees of freedom a node: `words` for scenes, `build` for arrays, flat sections, rigid parts."""
