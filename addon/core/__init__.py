"""The method, without Blender: numpy, scipy, embreex and OpenEXR only."""
