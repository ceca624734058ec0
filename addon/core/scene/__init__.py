"""Geometry alone: cameras and their lenses, the mesh, its surface elements, rays, what a frame sees of them."""
