"""Pictures of Footlight's scenes by Mitsuba 3: `mitsuba.py SCENE SETTINGS OUTPUT [--samples N]`.

Called by `footlight run show.lxq --renderer mitsuba`. Needs the package `mitsuba` (tried: 3.9.1).
A step of quality has four times the samples of the one before it: 16, 64, 256, 1024 a pixel, or
N, 4 N ... . The manual, page *farm*, describes the files; another renderer reads them
as this script does.
"""

import argparse
import json
import math
import sys
from pathlib import Path

# This script's own folder, where it would be taken for the package of its name.
sys.path.pop(0)

import mitsuba as mi
import numpy as np

# Texels across a spot's light, which the renderer throws as an image.
TEXELS = 512
# Half a beam, degrees, up to which that image serves.
WIDEST = 80


def camera(view):
    return {
        "type": "perspective",
        "fov": view["fov"],
        "fov_axis": "y",
        "to_world": mi.ScalarTransform4f().look_at(
            view["from"], view["to"], view["up"]
        ),
        "film": {
            "type": "hdrfilm",
            "width": view["width"],
            "height": view["height"],
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent"},
    }


def strengths(scene, settings):
    """What each light is multiplied by in each channel."""
    values = {c["name"]: c["value"] for c in settings["coordinates"]}
    sums = [np.zeros(3) for _ in scene["lights"]]
    for source in scene["sources"]:
        for light, factor in source["emitters"]:
            sums[light] += values.get(source["name"], 0.0) * np.array(factor)
    return sums


def image(texels, wrap):
    """A texture; past its border it goes on downwards as across."""
    bitmap = mi.Bitmap(np.ascontiguousarray(texels, np.float32))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "wrap_mode": wrap}


def surface(material, numbers):
    """What reflects diffusely from its front, and lets light pass where its texture is cut."""
    texture = material.get("texture")
    if texture is None:
        return {
            "type": "diffuse",
            "reflectance": {"type": "rgb", "value": material["reflectance"]},
        }
    shape = (texture["height"], texture["width"], 4)
    texels = np.frombuffer(numbers, "<f4", math.prod(shape), texture["offset"]).reshape(shape)
    wrap = texture["wrap"][0]
    front = {"type": "diffuse", "reflectance": image(texels[:, :, :3], wrap)}
    if not texture["cut"]:
        return front
    return {"type": "mask", "opacity": image(texels[:, :, 3:], wrap), "front": front}


def mesh(row, numbers, material, radiance):
    """Triangles; their backs are black."""
    count = 9 * row["triangles"]
    floats = np.frombuffer(numbers, "<f4", 2 * count, row["offset"])
    props = mi.Properties()
    props["bsdf"] = mi.load_dict(surface(material, numbers))
    if radiance.any():
        props["emitter"] = mi.load_dict(
            {"type": "area", "radiance": {"type": "rgb", "value": list(radiance)}}
        )
    corners = 3 * row["triangles"]
    places = row.get("places")
    out = mi.Mesh(
        "mesh",
        corners,
        row["triangles"],
        has_vertex_normals=True,
        has_vertex_texcoords=places is not None,
        props=props,
    )
    values = mi.traverse(out)
    values["vertex_positions"] = floats[:count].copy()
    values["vertex_normals"] = floats[count:].copy()
    if places is not None:
        values["vertex_texcoords"] = np.frombuffer(numbers, "<f4", 2 * corners, places).copy()
    values["faces"] = np.arange(corners, dtype=np.uint32)
    values.update()
    return out


def spot(light, strength):
    """A point that throws an image of its shares of intensity."""
    end = min(light["end"], math.radians(WIDEST))
    if light["end"] > end + 1e-9 and light["shares"][-2] > 0.01:
        raise SystemExit(f"a beam wider than {2 * WIDEST} degrees is not written for Mitsuba")
    side = (np.arange(TEXELS) + 0.5) / TEXELS * 2 - 1
    tangent = np.hypot(*np.meshgrid(side, side)) * math.tan(end)
    steps = np.linspace(0, light["end"], len(light["shares"]))
    shares = np.interp(np.arctan(tangent), steps, light["shares"], right=0.0)
    image = np.repeat(shares[:, :, None], 3, 2).astype(np.float32)
    ahead = [a - p for a, p in zip(light["aim"], light["position"])]
    upright = abs(ahead[0]) + abs(ahead[1]) > 1e-6 * abs(ahead[2])
    intensity = [float(i * s) for i, s in zip(light["intensity"], strength)]
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(
            light["position"], light["aim"], [0, 0, 1] if upright else [0, 1, 0]
        ),
        "intensity": {"type": "rgb", "value": intensity},
        "cutoff_angle": math.degrees(end),
        "beam_width": 0.99999 * math.degrees(end),
        "texture": {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True, "wrap_mode": "clamp"},
    }


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene", type=Path)
    parser.add_argument("settings", type=Path)
    parser.add_argument("output")
    parser.add_argument("--samples", type=int, default=16)
    args = parser.parse_args()
    mi.set_variant("llvm_ad_rgb" if works("llvm_ad_rgb") else "scalar_rgb")
    scene, settings = json.loads(args.scene.read_text()), json.loads(args.settings.read_text())
    if scene["schema"] != 1:
        raise SystemExit(f"schema {scene['schema']} is not known here")
    numbers = args.scene.with_suffix(".bin").read_bytes()
    radiance = [np.zeros(3) for _ in scene["materials"]]
    stage = {"type": "scene", "integrator": {"type": "path", "max_depth": -1, "rr_depth": 8}}
    stage["sensor"] = camera(settings["view"])
    for i, (light, strength) in enumerate(zip(scene["lights"], strengths(scene, settings))):
        if light["kind"] == "panel":
            radiance[light["material"]] += strength * np.array(light["radiance"])
        elif strength.any():
            stage[f"light{i}"] = spot(light, strength)
    for row in scene["meshes"]:
        material = scene["materials"][row["material"]]
        name = f"mesh{row['material']}"
        stage[name] = mesh(row, numbers, material, radiance[row["material"]])
    samples = args.samples * 4 ** (settings["quality"] - 1)
    image = mi.render(mi.load_dict(stage), spp=samples, seed=settings["seed"])
    mi.Bitmap(image).write(args.output)


def works(variant):
    """Is a variant there that compiles? It needs a library of LLVM."""
    try:
        mi.set_variant(variant)
        mi.Float(1.0) + 1.0
        return True
    except (ImportError, RuntimeError, AttributeError):
        return False


main()
