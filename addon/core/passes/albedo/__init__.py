"""Albedo = pi L_d / E, with a prior from its neighbourhood, and what stands in where nothing was seen."""
