"""Transport: the room as a light source, importance sampling, irradiance. Knows nothing of albedo or of fits."""
