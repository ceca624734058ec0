"""Roughness phi and specular psi of each object from the part of the frames that L_d does not explain."""
