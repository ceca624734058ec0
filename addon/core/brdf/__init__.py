"""What a surface does with light: the specular lobe, and how Blender's Principled BSDF layers it."""
