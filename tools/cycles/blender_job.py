"""Runs inside Blender: builds a scene once, or renders it with Cycles and tells how long that took.

    blender -b --factory-startup --python-exit-code 1 --python tools/cycles/blender_job.py -- build SCENE.json FILE.blend
    blender -b FILE.blend --python-exit-code 1 --python tools/cycles/blender_job.py -- render JOB.json

JOB.json: width, height, bounces, threads, seed, samples (a list; each is rendered and timed, the last one is kept), picture,
figures (files to write).

What a render costs is processor time of this process around the call alone: no start of Blender, no reading of the file, no writing
of the picture. It includes handing the scene to Cycles and building its tree, which whoever asks takes off by a render of one sample.
"""
import json
import resource
import sys
import tempfile
from array import array
from pathlib import Path

import bpy

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
import blender_scene  # noqa: E402
import scene_model  # noqa: E402

NO_LIMIT = 1024


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def set_cycles(job):
    """Nothing that trades bias for noise, or samples for time; everything else as it comes."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.seed, cycles.use_animated_seed = "CPU", job["seed"], False
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.time_limit = cycles.light_sampling_threshold = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.blur_glossy = 0
    cycles.use_fast_gi = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
    # Ours counts scatterings of light. Cycles counts those beyond the first: 0 is direct light.
    for limit in ("max", "diffuse", "glossy", "transmission"):
        setattr(cycles, limit + "_bounces", job["bounces"] - 1)
    cycles.transparent_max_bounces = NO_LIMIT
    cycles.use_auto_tile = False


def set_output(job):
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = job["width"], job["height"], 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1
    render.threads_mode, render.threads = "FIXED", job["threads"]
    render.use_compositing = render.use_sequencer = render.film_transparent = render.use_persistent_data = False
    settings = render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"


def timed_render(samples):
    bpy.context.scene.cycles.samples = samples
    start = cpu_s()
    bpy.ops.render.render()
    return cpu_s() - start


def save_pfm(path, width, height):
    """By way of a 32-bit EXR, which no view transform touches. PFM counts rows from the bottom, as Blender does."""
    with tempfile.TemporaryDirectory() as folder:
        exr = Path(folder) / "picture.exr"
        bpy.data.images["Render Result"].save_render(str(exr))
        image = bpy.data.images.load(str(exr))
        image.colorspace_settings.name = "Linear"
        rgba = array("f", bytes(16 * width * height))
        image.pixels.foreach_get(rgba)
    rgb = array("f", bytes(12 * width * height))
    for channel in range(3):
        rgb[channel::3] = rgba[channel::4]
    with open(path, "wb") as file:
        file.write(b"PF\n%d %d\n-1.0\n" % (width, height) + rgb.tobytes())


def render(path):
    job = json.loads(Path(path).read_text(encoding="utf-8"))
    set_cycles(job)
    set_output(job)
    timed_render(1)  # Reads textures and kernels for the first time.
    figures = {"cpu_s": [timed_render(samples) for samples in job["samples"]], "version": bpy.app.version_string}
    save_pfm(job["picture"], job["width"], job["height"])
    Path(job["figures"]).write_text(json.dumps(figures), encoding="utf-8")


def main():
    verb, *words = sys.argv[sys.argv.index("--") + 1:]
    if verb == "build":
        blender_scene.build(scene_model.read_scene(Path(words[0]).resolve()))
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(words[1]).resolve()), compress=False)
    else:
        render(words[0])


try:
    main()
except scene_model.Refused as refused:
    print(refused)
    sys.exit(2)
