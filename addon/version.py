"""The version; `blender_manifest.toml` and `pyproject.toml` say the same (a test compares them)."""

VERSION = "0.2.0"
