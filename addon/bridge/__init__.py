"""All code that touches Blender's data: arrays in, objects, images, materials, lamps and cameras out."""
