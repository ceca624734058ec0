"""Whether the frames fit the mesh: convention of the poses, and small misalignment. See docs/captures.md."""
