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

# Texels across a spot's light, which the renderer throws as an image; twice as many where it is wide.
TEXELS = 512
# Half a beam, degrees, up to which that image serves; of the most light this share may be lost beyond.
WIDEST = 86
LOST = 0.05


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


def air(haze):
    """Haze that fills all space. All scattering is in it: once, twice and more often."""
    return {
        "type": "homogeneous",
        "sigma_t": {"type": "rgb", "value": 3 * [haze["extinction"]]},
        "albedo": {"type": "rgb", "value": 3 * [haze["albedo"]]},
        "phase": {"type": "hg", "g": haze["forward"]},
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


def coat(material, matt):
    """A matt reflectance with the material's gloss over it, if it has any."""
    gloss = material.get("gloss")
    if gloss is None:
        return {"type": "diffuse", "reflectance": matt}
    normal = {"type": "rgb", "value": gloss["normal"]}
    if gloss["metal"]:
        roughness = gloss["roughness"]
        return {"type": "principled", "base_color": normal, "metallic": 1.0, "roughness": roughness}
    root = math.sqrt(max(gloss["normal"]))
    index = {"int_ior": (1 + root) / (1 - root), "ext_ior": 1.0, "diffuse_reflectance": matt}
    if gloss["roughness"] < 0.01:
        return {"type": "plastic", **index}
    return {"type": "roughplastic", "distribution": "ggx", "alpha": gloss["roughness"] ** 2, **index}


def surface(material, numbers):
    """What reflects from its front, and lets light pass where its texture is cut."""
    texture = material.get("texture")
    if texture is None:
        return coat(material, {"type": "rgb", "value": material["reflectance"]})
    shape = (texture["height"], texture["width"], 4)
    texels = np.frombuffer(numbers, "<f4", math.prod(shape), texture["offset"]).reshape(shape)
    wrap = texture["wrap"][0]
    front = coat(material, image(texels[:, :, :3], wrap))
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


def grid(row, numbers):
    """Numbers row by row."""
    count = row["width"] * row["height"]
    return np.frombuffer(numbers, "<f4", count, row["offset"]).reshape(row["height"], row["width"])


def placed(light):
    """Where a light is: it looks along Z, with `up` along Y and its right along minus X."""
    ahead = [a - p for a, p in zip(light["aim"], light["position"])]
    upright = abs(ahead[0]) + abs(ahead[1]) > 1e-6 * abs(ahead[2])
    up = light.get("up", [0, 0, 1] if upright else [0, 1, 0])
    return mi.ScalarTransform4f().look_at(light["position"], light["aim"], up)


def shares(light, numbers, ahead, across, upwards):
    """Shares of a spot's intensity by how far directions go along the axis, to the right and upwards."""
    steps = np.arctan2(np.hypot(across, upwards), ahead) / light["end"]
    if light["kind"] == "spot":
        table = light["shares"]
        return np.interp(steps * (len(table) - 1), range(len(table)), table, right=0.0)
    table = grid(light["table"], numbers)
    down = np.clip(steps, 0, 1) * (table.shape[0] - 1)
    turn = np.arctan2(upwards, across) / (2 * math.pi) % 1 * (table.shape[1] - 1)
    row = np.minimum(down.astype(int), table.shape[0] - 2)
    column = np.minimum(turn.astype(int), table.shape[1] - 2)
    across, down = turn - column, down - row
    upper = table[row, column] * (1 - across) + table[row, column + 1] * across
    lower = table[row + 1, column] * (1 - across) + table[row + 1, column + 1] * across
    return np.where(steps <= 1, upper * (1 - down) + lower * down, 0.0)


def spot(light, strength, numbers):
    """A point that throws an image of its shares of intensity."""
    end = min(light["end"], math.radians(WIDEST))
    rows = grid(light["table"], numbers) if "table" in light else np.array(light["shares"])
    beyond = rows[math.ceil(end / light["end"] * (len(rows) - 1)) :]
    if light["end"] > end and beyond.max() > LOST * rows.max():
        return cube(light, strength, numbers)
    texels = TEXELS * (2 if math.degrees(end) > 80 else 1)
    side = 1 - (np.arange(texels) + 0.5) / texels * 2
    across, upwards = (t * math.tan(end) for t in np.meshgrid(side, side))
    image = np.repeat(shares(light, numbers, 1, across, upwards)[:, :, None], 3, 2).astype(np.float32)
    emitter = {
        "type": "spot",
        "to_world": placed(light),
        "intensity": {"type": "rgb", "value": [float(i * s) for i, s in zip(light["intensity"], strength)]},
        "cutoff_angle": math.degrees(end),
        "beam_width": 0.99999 * math.degrees(end),
        "texture": {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True, "wrap_mode": "clamp"},
    }
    return [emitter]


def cube(light, strength, numbers):
    """A point that is too wide for one image throws one through each side of a cube."""
    frame = np.array(placed(light).matrix)[:3, :3]
    right, up, ahead = -frame[:, 0], frame[:, 1], frame[:, 2]
    side = (np.arange(TEXELS) + 0.5) / TEXELS * 2 - 1
    x, y = (t[:, :, None] for t in np.meshgrid(side, -side))
    out = []
    for forth, top in [(ahead, up), (-ahead, up), (right, up), (-right, up), (up, ahead), (-up, ahead)]:
        directions = forth + x * np.cross(forth, top) + y * top
        image = shares(light, numbers, *(directions @ axis for axis in (ahead, right, up)))
        if image.any():
            world = mi.ScalarTransform4f().look_at(light["position"], list(light["position"] + forth), list(top))
            out.append(projector(image, [1, 1], world, light, strength))
    return out


def projection(light, strength, numbers):
    """An image thrown through a frustum."""
    return [projector(grid(light["image"], numbers), light["half"], placed(light), light, strength)]


def projector(share, half, world, light, strength):
    """Mitsuba's projector is given the light of a white screen 1 m away: the intensity times the cube of
    the cosine, over pi."""
    height, width = share.shape
    across = ((np.arange(width) + 0.5) / width * 2 - 1) * half[0]
    upwards = ((np.arange(height) + 0.5) / height * 2 - 1) * half[1]
    cosine = 1 / np.sqrt(1 + across[None, :] ** 2 + upwards[:, None] ** 2)
    colour = np.array(light["intensity"]) * strength
    image = ((share * cosine**3 / math.pi)[:, :, None] * colour).astype(np.float32)
    return {
        "type": "projector",
        "to_world": world,
        "fov": 2 * math.degrees(math.atan(half[0])),
        "fov_axis": "x",
        "irradiance": {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True, "wrap_mode": "clamp"},
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
    if scene["schema"] not in (1, 2):
        raise SystemExit(f"schema {scene['schema']} is not known here")
    numbers = args.scene.with_suffix(".bin").read_bytes()
    radiance = [np.zeros(3) for _ in scene["materials"]]
    stage = {"type": "scene", "integrator": {"type": "path", "max_depth": -1, "rr_depth": 8}}
    stage["sensor"] = camera(settings["view"])
    if "haze" in scene:
        # The camera is in the haze, and no surface is a border of it.
        stage["integrator"]["type"] = "volpath"
        stage["sensor"]["medium"] = air(scene["haze"])
    for i, (light, strength) in enumerate(zip(scene["lights"], strengths(scene, settings))):
        if light["kind"] == "panel":
            radiance[light["material"]] += strength * np.array(light["radiance"])
        elif strength.any():
            kind = projection if light["kind"] == "projection" else spot
            for j, emitter in enumerate(kind(light, strength, numbers)):
                stage[f"light{i}_{j}"] = emitter
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
