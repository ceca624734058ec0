"""Shading S (irradiance E) from the lit room itself, the light from outside, the emitters, and albedo = pi L_d / E."""
