"""Pictures of Footlight's scenes by Blender's Cycles: `blender.py SCENE SETTINGS OUTPUT [--samples N]`.

Called by `footlight run show.lxq --renderer blender`, with Blender's own Python (tried: Blender 3.4.1).
A step of quality has four times the samples of the one before it: 16, 64, 256, 1024 a pixel, or
N, 4 N ... . The manual, page *farm*, describes the files.
"""

import argparse
import json
import math
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

# Bounces beyond which light is given up: less than 1e-4 of it where nine tenths are reflected.
BOUNCES = 96
# Triangles of a lamp at least: near larger ones Cycles samples directions to them, and 1 to 2 % of their
# light is lost there (Blender 3.4.1).
LAMP_TRIANGLES = 100
# How Blender names what goes on past a texture's border.
BEYOND = {"repeat": "REPEAT", "mirror": "MIRROR", "clamp": "EXTEND"}


def looking(place, target, up):
    """Where a camera or a lamp is that looks along its own -Z, with its Y upwards."""
    back = (Vector(place) - Vector(target)).normalized()
    right = Vector(up).cross(back).normalized()
    axes = Matrix((right, back.cross(right), back)).transposed()
    return Matrix.Translation(place) @ axes.to_4x4()


def put(name, data, matrix=None):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    if matrix is not None:
        thing.matrix_world = matrix
    return thing


def camera(view):
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle = math.radians(view["fov"])
    data.clip_start = 1e-3
    data.clip_end = 1e5
    scene = bpy.context.scene
    scene.camera = put("camera", data, looking(view["from"], view["to"], view["up"]))
    scene.render.resolution_x = view["width"]
    scene.render.resolution_y = view["height"]
    scene.render.resolution_percentage = 100


def strengths(scene, settings):
    """What each light is multiplied by in each channel."""
    values = {c["name"]: c["value"] for c in settings["coordinates"]}
    sums = [np.zeros(3) for _ in scene["lights"]]
    for source in scene["sources"]:
        for light, factor in source["emitters"]:
            sums[light] += values.get(source["name"], 0.0) * np.array(factor)
    return sums


def image(texture, numbers):
    """A texture of linear reflectances, with the share of light that is stopped as its alpha."""
    shape = (texture["height"], texture["width"], 4)
    texels = np.frombuffer(numbers, "<f4", math.prod(shape), texture["offset"]).reshape(shape)
    out = bpy.data.images.new("texture", shape[1], shape[0], alpha=True, float_buffer=True)
    out.colorspace_settings.name = "Non-Color"
    out.alpha_mode = "CHANNEL_PACKED"
    # Blender has the lowest row first.
    out.pixels.foreach_set(texels[::-1].ravel())
    out.pack()
    return out


def material(row, numbers, radiance):
    """What reflects and emits from its front, and is black behind."""
    out = bpy.data.materials.new(row["name"])
    out.use_nodes = True
    nodes, links = out.node_tree.nodes, out.node_tree.links
    nodes.clear()
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (*row["reflectance"], 1)
    front = diffuse.outputs[0]
    gloss = row.get("gloss")
    if gloss:
        lobe = nodes.new("ShaderNodeBsdfGlossy")
        lobe.distribution = "GGX"
        lobe.inputs["Roughness"].default_value = gloss["roughness"]
        over = nodes.new("ShaderNodeMixShader")
        root = math.sqrt(max(gloss["normal"]))
        if gloss["metal"]:
            lobe.inputs["Color"].default_value = (*gloss["normal"], 1)
            over.inputs[0].default_value = 1
        else:
            fresnel = nodes.new("ShaderNodeFresnel")
            fresnel.inputs["IOR"].default_value = (1 + root) / (1 - root)
            lobe.inputs["Color"].default_value = (1, 1, 1, 1)
            links.new(fresnel.outputs[0], over.inputs[0])
        links.new(front, over.inputs[1])
        links.new(lobe.outputs[0], over.inputs[2])
        front = over.outputs[0]
    if radiance.any():
        emission = nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = (*radiance, 1)
        both = nodes.new("ShaderNodeAddShader")
        links.new(front, both.inputs[0])
        links.new(emission.outputs[0], both.inputs[1])
        front = both.outputs[0]
    behind = nodes.new("ShaderNodeBsdfDiffuse")
    behind.inputs["Color"].default_value = (0, 0, 0, 1)
    sided = nodes.new("ShaderNodeMixShader")
    links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], sided.inputs[0])
    links.new(front, sided.inputs[1])
    links.new(behind.outputs[0], sided.inputs[2])
    shown = sided.outputs[0]
    texture = row.get("texture")
    if texture:
        texels = nodes.new("ShaderNodeTexImage")
        texels.image = image(texture, numbers)
        try:
            texels.extension = BEYOND[texture["wrap"][0]]
        except TypeError:
            raise SystemExit(f"this Blender has no textures that go on by {texture['wrap'][0]}")
        links.new(texels.outputs["Color"], diffuse.inputs["Color"])
        if texture["cut"]:
            cut = nodes.new("ShaderNodeMixShader")
            links.new(texels.outputs["Alpha"], cut.inputs[0])
            links.new(nodes.new("ShaderNodeBsdfTransparent").outputs[0], cut.inputs[1])
            links.new(shown, cut.inputs[2])
            shown = cut.outputs[0]
    links.new(shown, nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return out


def quartered(corners):
    """Each triangle in four, of corners in an array of (kinds, corners, numbers)."""
    a, b, c = (corners[:, k::3] for k in range(3))
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([np.stack(p, axis=2).reshape(a.shape[0], -1, a.shape[2]) for p in parts], axis=1)


def mesh(row, numbers, look, is_lamp):
    corners = 3 * row["triangles"]
    floats = np.frombuffer(numbers, "<f4", 6 * corners, row["offset"]).reshape(2, corners, 3)
    places = None
    if row.get("places") is not None:
        places = np.frombuffer(numbers, "<f4", 2 * corners, row["places"]).reshape(1, corners, 2)
    while is_lamp and floats.shape[1] < 3 * LAMP_TRIANGLES:
        floats = quartered(floats)
        places = None if places is None else quartered(places)
    corners = floats.shape[1]
    data = bpy.data.meshes.new("mesh")
    data.from_pydata(floats[0].tolist(), [], np.arange(corners).reshape(-1, 3).tolist())
    data.polygons.foreach_set("use_smooth", [True] * (corners // 3))
    if hasattr(data, "use_auto_smooth"):
        data.use_auto_smooth = True
    data.normals_split_custom_set(floats[1].tolist())
    if places is not None:
        upwards = places[0] * (1, -1) + (0, 1)
        data.uv_layers.new().data.foreach_set("uv", upwards.ravel())
    data.materials.append(look)
    thing = put("mesh", data)
    thing.cycles.shadow_terminator_geometry_offset = 0
    thing.cycles.shadow_terminator_offset = 0


class Lamp:
    """A point of so much intensity, times what its nodes make of a direction."""

    def __init__(self, light, strength):
        self.data = bpy.data.lights.new("lamp", "POINT")
        self.data.shadow_soft_size = 0
        # Watts all round that make one a steradian.
        self.data.energy = 4 * math.pi
        self.data.use_nodes = True
        self.nodes, self.links = self.data.node_tree.nodes, self.data.node_tree.links
        self.emission = next(n for n in self.nodes if n.type == "EMISSION")
        intensity = np.array(light["intensity"]) * strength
        self.emission.inputs["Color"].default_value = (*intensity, 1)
        direction = self.nodes.new("ShaderNodeSeparateXYZ")
        self.links.new(self.nodes.new("ShaderNodeTexCoord").outputs["Normal"], direction.inputs[0])
        self.right, self.up = direction.outputs["X"], direction.outputs["Y"]
        self.ahead = self.math("MULTIPLY", direction.outputs["Z"], -1)
        ahead = [a - p for a, p in zip(light["aim"], light["position"])]
        upright = abs(ahead[0]) + abs(ahead[1]) > 1e-6 * abs(ahead[2])
        up = light.get("up", (0, 0, 1) if upright else (0, 1, 0))
        put("lamp", self.data, looking(light["position"], light["aim"], up))

    def math(self, operation, *values):
        """What an operation makes of numbers and outputs of nodes."""
        node = self.nodes.new("ShaderNodeMath")
        node.operation = operation
        for value, place in zip(values, node.inputs):
            if isinstance(value, (int, float)):
                place.default_value = value
            else:
                self.links.new(value, place)
        return node.outputs[0]

    def steps(self, light):
        """The angle to the axis, where a law ends at 1."""
        return self.math("DIVIDE", self.math("ARCCOSINE", self.ahead), light["end"])

    def image(self, row, numbers, across, upwards):
        """What a grid of numbers has at a place, 0 to 1 from the left and from its lowest row."""
        shares = np.frombuffer(numbers, "<f4", row["width"] * row["height"], row["offset"])
        shares = shares.reshape(row["height"], row["width"])[::-1]
        texels = self.nodes.new("ShaderNodeTexImage")
        texels.image = bpy.data.images.new("grid", row["width"], row["height"], float_buffer=True)
        texels.image.colorspace_settings.name = "Non-Color"
        texels.image.pixels.foreach_set(np.repeat(shares.ravel(), 4))
        texels.image.pack()
        texels.extension = "EXTEND"
        place = self.nodes.new("ShaderNodeCombineXYZ")
        self.links.new(across, place.inputs[0])
        self.links.new(upwards, place.inputs[1])
        self.links.new(place.outputs[0], texels.inputs["Vector"])
        return texels.outputs["Color"]

    def shine(self, share, *within):
        """With a share of the intensity, where all of `within` are 1."""
        for inside in within:
            share = self.math("MULTIPLY", share, inside)
        self.links.new(share, self.emission.inputs["Strength"])


def spot(light, strength, numbers):
    """Its intensity depends on the angle to its axis."""
    lamp = Lamp(light, strength)
    steps = lamp.steps(light)
    table = lamp.nodes.new("ShaderNodeFloatCurve")
    table.mapping.extend = "HORIZONTAL"
    points = table.mapping.curves[0].points
    shares = light["shares"]
    for i, share in enumerate(shares[1:-1], 1):
        points.new(i / (len(shares) - 1), share)
    points[0].location = (0, shares[0])
    points[len(points) - 1].location = (1, shares[-1])
    for point in points:
        point.handle_type = "VECTOR"
    table.mapping.update()
    lamp.links.new(steps, table.inputs["Value"])
    lamp.shine(table.outputs[0], lamp.math("LESS_THAN", steps, 1))


def measured(light, strength, numbers):
    """Its intensity is a table by the angles to its axis and around it."""
    lamp = Lamp(light, strength)
    steps = lamp.steps(light)
    width, height = light["table"]["width"], light["table"]["height"]
    turn = lamp.math("DIVIDE", lamp.math("ARCTAN2", lamp.up, lamp.right), 2 * math.pi)
    turn = lamp.math("FRACT", turn)
    # From the middle of the first texel to that of the last.
    across = lamp.math("MULTIPLY_ADD", turn, 1 - 1 / width, 0.5 / width)
    upwards = lamp.math("MULTIPLY_ADD", steps, 1 / height - 1, 1 - 0.5 / height)
    share = lamp.image(light["table"], numbers, across, upwards)
    lamp.shine(share, lamp.math("LESS_THAN", steps, 1))


def projection(light, strength, numbers):
    """It throws an image through a frustum."""
    lamp = Lamp(light, strength)
    places, within = [], [lamp.math("GREATER_THAN", lamp.ahead, 0)]
    for side, half in zip((lamp.right, lamp.up), light["half"]):
        tangent = lamp.math("DIVIDE", side, lamp.ahead)
        places.append(lamp.math("MULTIPLY_ADD", tangent, 0.5 / half, 0.5))
        within.append(lamp.math("LESS_THAN", lamp.math("ABSOLUTE", tangent), half))
    lamp.shine(lamp.image(light["image"], numbers, *places), *within)


LAMPS = {"spot": spot, "measured": measured, "projection": projection}


def air(haze):
    """Haze that fills all space. All scattering is in it: once, twice and more often."""
    tree = bpy.context.scene.world.node_tree
    scatter = tree.nodes.new("ShaderNodeVolumeScatter")
    scatter.inputs["Color"].default_value = (1, 1, 1, 1)
    scatter.inputs["Density"].default_value = haze["extinction"] * haze["albedo"]
    scatter.inputs["Anisotropy"].default_value = haze["forward"]
    absorption = tree.nodes.new("ShaderNodeVolumeAbsorption")
    absorption.inputs["Color"].default_value = (0, 0, 0, 1)
    absorption.inputs["Density"].default_value = haze["extinction"] * (1 - haze["albedo"])
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(scatter.outputs[0], both.inputs[0])
    tree.links.new(absorption.outputs[0], both.inputs[1])
    world = next(n for n in tree.nodes if n.type == "OUTPUT_WORLD")
    tree.links.new(both.outputs[0], world.inputs["Volume"])
    bpy.context.scene.cycles.volume_bounces = BOUNCES


def cycles(settings, args):
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    options = scene.cycles
    options.samples = args.samples * 4 ** (settings["quality"] - 1)
    options.seed = settings["seed"] % 2**31
    options.use_adaptive_sampling = False
    options.use_denoising = args.denoise
    options.max_bounces = options.diffuse_bounces = BOUNCES
    options.transparent_max_bounces = BOUNCES
    options.sample_clamp_direct = options.sample_clamp_indirect = 0
    options.light_sampling_threshold = 0
    options.pixel_filter_type = "BOX"
    options.filter_width = 1
    world = scene.world = bpy.data.worlds.new("dark")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.color_depth = "32"
    scene.render.use_file_extension = False


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scene", type=Path)
    parser.add_argument("settings", type=Path)
    parser.add_argument("output")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--denoise", action="store_true")
    args = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])
    scene, settings = json.loads(args.scene.read_text()), json.loads(args.settings.read_text())
    if scene["schema"] not in (1, 2):
        raise SystemExit(f"schema {scene['schema']} is not known here")
    numbers = args.scene.with_suffix(".bin").read_bytes()
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    radiance = [np.zeros(3) for _ in scene["materials"]]
    for light, strength in zip(scene["lights"], strengths(scene, settings)):
        if light["kind"] == "panel":
            radiance[light["material"]] += strength * np.array(light["radiance"])
        elif strength.any():
            LAMPS[light["kind"]](light, strength, numbers)
    for row in scene["meshes"]:
        number = row["material"]
        look = material(scene["materials"][number], numbers, radiance[number])
        mesh(row, numbers, look, radiance[number].any())
    camera(settings["view"])
    cycles(settings, args)
    if "haze" in scene:
        air(scene["haze"])
    bpy.context.scene.render.filepath = args.output
    bpy.ops.render.render(write_still=True)


main()
