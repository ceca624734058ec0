"""A frame's photograph beside the same view of scene.blend, of the room in the window's saved file, and of it relit.

    .venv-of-blender-5.2/bin/python scripts/side_by_side.py FRAME.exr SCENE.blend WINDOW.blend RELIT.blend --out PICTURE

Needs `bpy` of the version that saved the files. Each is shown under its own scene's exposure and view transform, the
photograph under those of SCENE.blend. The camera is the one that was made for FRAME. Prints the PSNR between the second
and the third, rendered with the same seed. Refit nothing meanwhile: all three files show the result folder's images.
"""

import argparse
import tempfile
from pathlib import Path

import bpy
import numpy as np
from PIL import Image, ImageDraw, ImageFont

WIDTH = 480
LABELS = "Photograph", "scene.blend", "In the window", "Relit: a lamp off, a softbox on"
BAR = 30


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("frame", type=Path)
    parser.add_argument("blends", type=Path, nargs=3, metavar="BLEND")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        pictures = []
        for number, blend in enumerate(options.blends):
            scene = open_scene(blend, options.frame.stem, options.samples)
            if number == 0:
                pictures.append(as_shown(options.frame.absolute(), scene, Path(folder) / "photograph.png"))
            render = Path(folder) / f"{number}.exr"
            scene.render.filepath = str(render)
            bpy.ops.render.render(write_still=True, scene=scene.name)
            pictures.append(as_shown(render, scene, render.with_suffix(".png")))
        print(f"PSNR between scene.blend and the window's scene: {decibels(pictures[1], pictures[2]):.1f} dB")
        print(f"PSNR between the photograph and scene.blend: {decibels(pictures[0], pictures[1]):.1f} dB")
    join(pictures).save(options.out, quality=90, subsampling=0, optimize=True)


def open_scene(blend: Path, frame: str, samples: int) -> bpy.types.Scene:
    """The room's scene of a file, ready to render through a frame's camera."""
    bpy.ops.wm.open_mainfile(filepath=str(blend.absolute()), load_ui=False)
    scene = next(candidate for candidate in bpy.data.scenes if candidate.get("scan_relight_own"))
    scene.camera = next(
        obj for obj in scene.objects if obj.type == "CAMERA" and Path(obj.get("frame_path", "")).stem == frame
    )
    width, height = scene.camera["width"], scene.camera["height"]
    render, cycles = scene.render, scene.cycles
    render.engine, cycles.device, cycles.samples, cycles.seed = "CYCLES", "CPU", samples, 0
    cycles.use_denoising = True  # where Blender was built with a denoiser
    cycles.use_adaptive_sampling = render.use_compositing = render.use_sequencer = False
    render.resolution_x, render.resolution_y = WIDTH, round(WIDTH * height / width)
    render.resolution_percentage = 100
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    return scene


def as_shown(picture: Path, scene: bpy.types.Scene, out: Path) -> np.ndarray:
    """A linear picture under a scene's exposure and view transform, (h, w, 3) uint8."""
    image = bpy.data.images.load(str(picture))
    image.colorspace_settings.name = "Linear Rec.709"
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "PNG", "8"
    image.save_render(str(out), scene=scene)
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    with Image.open(out) as displayed:
        displayed = displayed.convert("RGB")
        size = WIDTH, round(WIDTH * displayed.height / displayed.width)
        return np.asarray(displayed.resize(size, Image.Resampling.LANCZOS) if displayed.size != size else displayed)


def decibels(first: np.ndarray, second: np.ndarray) -> float:
    """PSNR of two pictures as a screen shows them."""
    return float(-10 * np.log10(max(np.mean((first / 255 - second / 255) ** 2), 1e-12)))


def join(pictures: list[np.ndarray]) -> Image.Image:
    """Two by two, each with its name above."""
    height, gap = pictures[0].shape[0] + BAR, 6
    sheet = Image.new("RGB", (2 * WIDTH + gap, 2 * height + gap), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(17)
    for number, (picture, label) in enumerate(zip(pictures, LABELS, strict=True)):
        left, top = number % 2 * (WIDTH + gap), number // 2 * (height + gap)
        draw.text((left + 4, top + 5), label, fill="black", font=font)
        sheet.paste(Image.fromarray(picture), (left, top + BAR))
    return sheet


if __name__ == "__main__":
    main()
