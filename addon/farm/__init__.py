"""A recovery on many machines, as jobs of existing render-farm engines. `core/pipeline` does the work; no Blender."""
