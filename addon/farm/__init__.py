"""A recovery on many machines: work as engines that exist take it. The work itself is `core/pipeline`'s; no Blender."""
