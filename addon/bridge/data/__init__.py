"""Blender's own data made from descriptions: meshes, images, materials, world, cameras; and back into arrays."""
