"""Names of the formats and the files by which a user knows each, and of segments: what is needed before NumPy is."""

FORMATS = {
    "replica": "textures/parameters.json beside mesh.ply",
    "fipt": "train/transforms.json beside scene.obj",
    "fipt-real": "cam.txt and K_list.txt",
    "scannet++": "dslr/colmap and scans/mesh_aligned_0.05.ply",
    "polycam": "keyframes with a folder of cameras",
    "record3d": "metadata.json beside rgb or rgbd",
    "stray": "odometry.csv beside rgb.mp4",
    "traj": "traj.txt and results/frame000000.exr",
    "nerfstudio": "transforms.json",
    "colmap": "cameras and images of a COLMAP model (.bin or .txt)",
    "textured": "one textured mesh (.glb, .gltf or .obj) alone",
}
"""In the order of `readers.READERS`."""
MATERIALS, SHAPE = "materials", "shape"
"""What segments can be, other than a file of them."""
