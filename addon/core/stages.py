"""The stages of a run: names, order, and what they are called in front of artists. Every interface needs them at its
start, so nothing is imported here."""

READ = "read"
"""Comes before all stages: the capture is read."""
STAGES = ("surface", "lit_diffuse", "shading", "specular")
"""Those of the method, in their order; what each has found is stored in the result folder."""
WRITE = "write"
"""Comes after them: images, scene.blend, report."""
RUN_STAGES = (*STAGES, WRITE)
"""What a run can be asked to end with, or to begin anew from."""
LABELS = {
    READ: "Reading the capture",
    "surface": "Surface",
    "lit_diffuse": "Frames to texture",
    "shading": "Light and albedo",
    "specular": "Highlights",
    WRITE: "Writing",
}
