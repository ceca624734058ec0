"""The room as a scene: written to scene.blend, its parts and settings, what it was when it was made."""
