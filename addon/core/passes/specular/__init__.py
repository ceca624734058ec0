"""Roughness, specular and the model of each object from the part of the frames that L_d does not explain."""
