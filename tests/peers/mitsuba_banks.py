"""Footlight beside Mitsuba 3, raw and denoised by OpenImageDenoise: processor seconds to render every
bank alone, at equal error.

    python3 tests/peers/mitsuba_banks.py REFS [--scenes stage cornell] [--samples 4 16 64]
    python3 tests/peers/mitsuba_banks.py ROOMS --scenes box1000 eight100000

REFS holds a folder for each scene with the references BANK_A.exr and BANK_B.exr; ROOMS holds
NAME.obj and NAME.lxq as well. Needs the packages `mitsuba` (3.9.1), `pyoidn` (2.5.1) and `numpy`, and
`target/release/banks` (a study). `llvm_ad_rgb` needs LLVM 17 or newer (DRJIT_LIBLLVM_PATH names it); without
it `scalar_rgb` is used, and said so. Nothing of this is needed to build or test Footlight.

All are measured in the same run on the same machine, by the same measure: relative RMSE of each
bank without the references' noise, pixels beside a lamp left out, the mean over the banks. Seconds
are processor seconds of all threads. Mitsuba's are without loading and compiling (each scene is
rendered once before), those of its denoised pictures with the albedo and normals that the denoiser
is given (once for all banks) and the denoiser. Footlight's are those of the whole program, which also
reads the show and the references. Between two measured errors the seconds are interpolated, beyond the
last one raw pictures are extrapolated by error ~ 1/sqrt(samples); denoised ones are not, they stop
falling.
"""

import argparse
import math
import re
import resource
import subprocess
import time
from pathlib import Path

import mitsuba as mi
import numpy as np
from pyoidn import denoise

ROOT = Path(__file__).resolve().parents[2]
# Camera of each scene: eye, target, up, vertical field in degrees, width, height.
VIEWS = {
    "stage": ([0, 1.9, 13.5], [0, 2.15, 0], [0, 1, 0], 25.0, 320, 180),
    "cornell": ([2.78, 2.73, -8.0], [2.78, 2.73, 0.0], [0, 1, 0], 39.3077, 256, 256),
}
ROOM = ([0, -4.8, 2.6], [0, 1, 1.4], [0, 0, 1], 62.0, 320, 180)
# Across the image that a spot throws.
SPOT_TEXELS = 512
# Samples of albedo and normals, which are the same for all banks.
GUIDE_SAMPLES = 16
WANTED = (0.05, 0.03, 0.02, 0.015, 0.01, 0.007, 0.004)


class Scene:
    """Where a scene's files are, its camera, and the emitted radiance of each bank's material."""

    def __init__(self, references, name):
        self.references = references / name
        self.spots = {}
        self.banks = sorted(p.name[:-6] for p in self.references.glob("*_A.exr") if p.name != "mix_A.exr")
        if name in VIEWS:
            folder = ROOT / "examples/reference" / name
            self.obj, self.mtl, self.show = folder / "scene.obj", folder / "scene.mtl", folder / f"{name}.lxq"
            self.view = VIEWS[name]
            self.emission = {b: (f"bank_{b}", materials(self.mtl)[f"bank_{b}"]["Ke"]) for b in self.banks}
            self.brightest = 2.9
        else:
            self.show = references / f"{name}.lxq"
            text = self.show.read_text()
            self.obj = references / re.search(r'stage "(.+?)"', text)[1]
            self.mtl = references / "rooms.mtl"
            self.view = ROOM
            found = re.findall(r"light \w+ panel (\w+) (\d+) cd/m2", text)
            self.emission = {material: (material, [float(radiance)] * 3) for material, radiance in found}
            self.brightest = 0.99 * min(r[0] for _, r in self.emission.values())
            spots = {line.split()[1]: spot(line) for line in text.splitlines() if " spot at " in line}
            banks = re.findall(r"bank (\w+) = (\w+)", text)
            self.spots = {bank: spots[light] for bank, light in banks if light in spots}
        self.halves = [[read(self.references / f"{b}_{half}.exr") for half in "AB"] for b in self.banks]
        self.mask = self.counted()

    def counted(self):
        """Pixels whose 3 x 3 neighbourhood shows no lamp of any bank."""
        lamp = np.any([h.max(axis=2) > self.brightest for pair in self.halves for h in pair], axis=0)
        wide = np.pad(lamp, 1)
        h, w = lamp.shape
        near = np.any([wide[j : j + h, i : i + w] for j in range(3) for i in range(3)], axis=0)
        return ~near

    def load(self, bank):
        """The scene with one bank at full."""
        eye, target, up, field, width, height = self.view
        scene = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": -1, "rr_depth": 8},
            "sensor": {
                "type": "perspective",
                "fov": field,
                "fov_axis": "y",
                "to_world": mi.ScalarTransform4f().look_at(eye, target, up),
                "film": {
                    "type": "hdrfilm",
                    "width": width,
                    "height": height,
                    "pixel_format": "rgb",
                    "component_format": "float32",
                    "rfilter": {"type": "box"},
                },
                "sampler": {"type": "multijitter"},
            },
        }
        if bank in self.spots:
            scene["spot"] = self.spots[bank]
        stuff = materials(self.mtl)
        lit, radiance = self.emission.get(bank, (None, None))
        for material, polygons in faces(self.obj).items():
            emitted = radiance if material == lit else [0, 0, 0]
            scene[material] = mesh(polygons, stuff[material]["Kd"], emitted)
        return mi.load_dict(scene)


def spot(line):
    """Of a line `light NAME spot at X,Y,Z aim X,Y,Z beam DEGREES field DEGREES N cd`: an image of the law of
    `src/show/geometry/profile.rs` is thrown, so that its light is ours."""
    number = r"(-?[\d.]+)"
    place = ",".join([number] * 3)
    words = rf"spot at {place} aim {place} beam {number} field {number} {number} cd"
    numbers = [float(n) for n in re.search(words, line).groups()]
    half, tenth = (math.radians(n) / 2 for n in numbers[6:8])
    power = math.log(math.log2(10)) / math.log(tenth / half)
    end = tenth * (1 + 2 / (math.log(10) * power))
    side = 1 - (np.arange(SPOT_TEXELS) + 0.5) / SPOT_TEXELS * 2
    angle = np.arctan(np.hypot(*(t * math.tan(end) for t in np.meshgrid(side, side))))
    core = np.exp2(-((angle / half) ** power))
    skirt = 0.1 * np.clip((end - angle) / (end - tenth), 0, 1) ** 2
    image = np.repeat(np.where(angle <= tenth, core, skirt)[:, :, None], 3, 2).astype(np.float32)
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(numbers[:3], numbers[3:6], [0, 1, 0]),
        "intensity": {"type": "rgb", "value": [numbers[8]] * 3},
        "cutoff_angle": math.degrees(end),
        "beam_width": 0.99999 * math.degrees(end),
        "texture": {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True, "wrap_mode": "clamp"},
    }


def materials(path):
    out, name = {}, None
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["newmtl"]:
            name = words[1]
            out[name] = {"Kd": [0, 0, 0], "Ke": [0, 0, 0]}
        elif words[:1] in (["Kd"], ["Ke"]):
            out[name][words[0]] = [float(w) for w in words[1:4]]
    return out


def faces(path):
    """Polygons of each material."""
    vertices, out, name = [], {}, None
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(w) for w in words[1:4]])
        elif words[:1] == ["usemtl"]:
            name = words[1]
        elif words[:1] == ["f"]:
            corners = [vertices[int(w.split("/")[0]) - 1] for w in words[1:]]
            out.setdefault(name, []).append(corners)
    return out


def mesh(polygons, reflectance, radiance):
    """One mesh of triangles, one-sided and diffuse."""
    points, faces = [], []
    for corners in polygons:
        first = len(points)
        points += corners
        faces += [[first, first + i, first + i + 1] for i in range(1, len(corners) - 1)]
    props = mi.Properties()
    props["bsdf"] = mi.load_dict(
        {"type": "diffuse", "reflectance": {"type": "rgb", "value": reflectance}}
    )
    if any(radiance):
        props["emitter"] = mi.load_dict(
            {"type": "area", "radiance": {"type": "rgb", "value": radiance}}
        )
    out = mi.Mesh("mesh", len(points), len(faces), props=props)
    values = mi.traverse(out)
    values["vertex_positions"] = np.array(points, np.float32).ravel()
    values["faces"] = np.array(faces, np.uint32).ravel()
    values.update()
    return out


def read(path):
    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))


def error(image, halves, mask):
    a, b = (h[mask].astype(np.float64) for h in halves)
    x = image[mask].astype(np.float64)
    fair = np.mean((x - a) * (x - b)) / np.mean((0.5 * (a + b)) ** 2)
    return math.sqrt(max(fair, 0.0))


def guides(scene):
    """Albedo and normals, without light."""
    integrator = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
    out = np.array(mi.render(scene, integrator=integrator, spp=GUIDE_SAMPLES, seed=3), np.float32)
    return np.ascontiguousarray(out[:, :, -6:-3]), np.ascontiguousarray(out[:, :, -3:])


def mitsuba(scene, samples):
    """Points (processor seconds for all banks, mean error), raw and denoised, for each number of
    samples."""
    loaded = [scene.load(bank) for bank in scene.banks]
    guides(loaded[0])
    begin = time.process_time()
    albedo, normal = guides(loaded[0])
    guided = time.process_time() - begin
    clean = lambda image: denoise(image, albedo=albedo, normal=normal, hdr=True, clean_aux=True, quality="high")
    raw, denoised = [], []
    for spp in samples:
        seconds, cleaning, errors, better = 0.0, guided, [], []
        for room, pair in zip(loaded, scene.halves):
            clean(np.array(mi.render(room, spp=spp, seed=1), np.float32))
            begin = time.process_time()
            image = np.array(mi.render(room, spp=spp, seed=2), np.float32)
            seconds += time.process_time() - begin
            begin = time.process_time()
            smooth = clean(image)
            cleaning += time.process_time() - begin
            errors.append(error(image, pair, scene.mask))
            better.append(error(smooth, pair, scene.mask))
        raw.append((seconds, float(np.mean(errors))))
        denoised.append((seconds + cleaning, float(np.mean(better))))
        print(
            f"  mitsuba {spp:5} samples {raw[-1][0]:9.3f} s {raw[-1][1] * 100:7.2f} %"
            f"   denoised {denoised[-1][0]:9.3f} s {denoised[-1][1] * 100:7.2f} %",
            flush=True,
        )
    return raw, denoised


def footlight(scene):
    """Points (processor seconds of the whole program, mean error) for each step of quality."""
    out = []
    for quality in range(1, 4):
        command = [ROOT / "target/release/banks", scene.show]
        command += ["--reference", scene.references, "--quality", str(quality), "--once"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        # The last line: step, seconds, mean error in percent.
        out.append((seconds, float(said.splitlines()[-1].split()[2]) / 100))
        print(f"  footlight quality {quality} {out[-1][0]:9.3f} s {out[-1][1] * 100:7.2f} %", flush=True)
    return out


def seconds_at(wanted, points, extrapolate):
    """Seconds at an error by points of rising seconds, in words and as a number where there is one."""
    points = sorted(points)
    if points[0][1] <= wanted:
        return f"at most {points[0][0]:.2f} s", points[0][0]
    for (fast, rough), (slow, fine) in zip(points, points[1:]):
        if fine <= wanted:
            share = math.log(rough / wanted) / math.log(rough / fine)
            seconds = fast * (slow / fast) ** share
            return f"{seconds:.2f} s", seconds
    slow, fine = points[-1]
    if extrapolate:
        seconds = slow * (fine / wanted) ** 2
        return f"{seconds:.0f} s (extrapolated)", seconds
    return f"not in {slow:.0f} s", None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("references", type=Path)
    parser.add_argument("--scenes", nargs="+", default=list(VIEWS))
    parser.add_argument("--samples", nargs="+", type=int, default=[4, 16, 64, 256])
    options = parser.parse_args()
    try:
        mi.set_variant("llvm_ad_rgb")
        mi.load_dict({"type": "sphere"})
    except Exception as reason:
        print(f"llvm_ad_rgb is not available ({reason}): scalar_rgb, which is slower")
        mi.set_variant("scalar_rgb")
    print(f"Mitsuba {mi.__version__}, {mi.variant()}")
    for name in options.scenes:
        scene = Scene(options.references, name)
        print(f"{name}, {len(scene.banks)} banks")
        ours = footlight(scene)
        raw, denoised = mitsuba(scene, options.samples)
        for wanted in WANTED:
            reached = [t for t, off in ours if off <= wanted]
            if not reached:
                print(f"  at {wanted * 100:.1f} %: no step of Footlight is that exact")
                continue
            best = min(reached)
            words = []
            for what, points, extrapolate in (("raw", raw, True), ("denoised", denoised, False)):
                said, seconds = seconds_at(wanted, points, extrapolate)
                times = "" if seconds is None else f", {seconds / best:.1f} times"
                words.append(f"{what} {said}{times}")
            print(f"  at {wanted * 100:.1f} %: {best:.2f} s; {'; '.join(words)}")


if __name__ == "__main__":
    main()
