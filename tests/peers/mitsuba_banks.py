"""Footlight beside Mitsuba 3: seconds to render every bank alone, at equal error.

    python3 tests/peers/mitsuba_banks.py REFS [--scenes stage cornell] [--samples 4 16 64]

REFS holds a folder for each scene with the references BANK_A.exr and BANK_B.exr. Needs the
packages `mitsuba` (3.9.1) and `numpy`, and `target/release/footlight`. `llvm_ad_rgb` needs LLVM 17
or newer (DRJIT_LIBLLVM_PATH names it); without it `scalar_rgb` is used, and said so. Nothing of
this is needed to build or test Footlight.

Both are measured in the same run on the same machine, by the same measure: relative RMSE of each
bank without the references' noise, pixels beside a lamp left out, the mean over the banks. Mitsuba
is timed without loading and compiling (each scene is rendered once before), Footlight from nothing
prepared. Where Mitsuba did not reach an error, its time is extrapolated by error ~ 1/sqrt(samples).
"""

import argparse
import json
import math
import subprocess
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
# Camera of each scene: eye, target, vertical field in degrees, width, height (Y up, as its OBJ).
VIEWS = {
    "stage": ([0, 1.9, 13.5], [0, 2.15, 0], 25.0, 320, 180),
    "cornell": ([2.78, 2.73, -8.0], [2.78, 2.73, 0.0], 39.3077, 256, 256),
}
BRIGHTER_THAN_ANY_LIT_SURFACE = 2.9


def materials(folder):
    out, name = {}, None
    for line in (folder / "scene.mtl").read_text().splitlines():
        words = line.split()
        if words[:1] == ["newmtl"]:
            name = words[1]
            out[name] = {"Kd": [0, 0, 0], "Ke": [0, 0, 0]}
        elif words[:1] in (["Kd"], ["Ke"]):
            out[name][words[0]] = [float(w) for w in words[1:4]]
    return out


def quads(folder):
    """Polygons of each material."""
    vertices, out, name = [], {}, None
    for line in (folder / "scene.obj").read_text().splitlines():
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


def load(name, bank):
    folder = ROOT / "examples/reference" / name
    eye, target, field, width, height = VIEWS[name]
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1, "rr_depth": 8},
        "sensor": {
            "type": "perspective",
            "fov": field,
            "fov_axis": "y",
            "to_world": mi.ScalarTransform4f().look_at(eye, target, [0, 1, 0]),
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
    stuff = materials(folder)
    for material, polygons in quads(folder).items():
        lit = material == f"bank_{bank}"
        radiance = stuff[material]["Ke"] if lit else [0, 0, 0]
        scene[material] = mesh(polygons, stuff[material]["Kd"], radiance)
    return mi.load_dict(scene)


def read(path):
    return np.array(mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))


def counted(halves):
    """Pixels whose 3 x 3 neighbourhood shows no lamp of any bank."""
    lamp = np.any([h.max(axis=2) > BRIGHTER_THAN_ANY_LIT_SURFACE for pair in halves for h in pair], axis=0)
    wide = np.pad(lamp, 1)
    h, w = lamp.shape
    near = np.any([wide[j : j + h, i : i + w] for j in range(3) for i in range(3)], axis=0)
    return ~near


def error(image, halves, mask):
    a, b = (h[mask].astype(np.float64) for h in halves)
    x = image[mask].astype(np.float64)
    fair = np.mean((x - a) * (x - b)) / np.mean((0.5 * (a + b)) ** 2)
    return math.sqrt(max(fair, 0.0))


def mitsuba(name, banks, halves, mask, samples):
    """(seconds for all banks, mean error) for each number of samples."""
    scenes = {bank: load(name, bank) for bank in banks}
    out = []
    for spp in samples:
        total, errors = 0.0, []
        for bank, pair in zip(banks, halves):
            np.array(mi.render(scenes[bank], spp=spp, seed=1))
            begin = time.perf_counter()
            image = np.array(mi.render(scenes[bank], spp=spp, seed=2))
            total += time.perf_counter() - begin
            errors.append(error(image, pair, mask))
        out.append((total, float(np.mean(errors))))
        print(f"  mitsuba   {spp:5} samples {total:9.3f} s {out[-1][1] * 100:7.2f} %", flush=True)
    return out


def footlight(name, folder):
    """(seconds for all banks, mean error) for each step of quality."""
    show = ROOT / "examples/reference" / name / f"{name}.lxq"
    out = []
    for quality in range(1, 6):
        command = [ROOT / "target/release/footlight", "compare", show, "--reference", folder]
        command += ["--quality", str(quality), "--json", "--quiet"]
        found = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
        errors = [abs(b["rmse_noise_free_no_emitters"]) for b in found["banks"]]
        out.append((found["seconds"], float(np.mean(errors))))
        print(f"  footlight quality {quality} {out[-1][0]:9.3f} s {out[-1][1] * 100:7.2f} %", flush=True)
    return out


def seconds_at(wanted, points):
    """Seconds at an error from points of falling error, and whether that was extrapolated."""
    at, off = min(points, key=lambda p: abs(math.log(p[1] / wanted)))
    return at * (off / wanted) ** 2, wanted < min(p[1] for p in points)


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
        folder = options.references / name
        banks = sorted(p.name[:-6] for p in folder.glob("*_A.exr") if p.name != "mix_A.exr")
        halves = [[read(folder / f"{bank}_{half}.exr") for half in "AB"] for bank in banks]
        print(f"{name}, {len(banks)} banks")
        ours = footlight(name, folder)
        theirs = mitsuba(name, banks, halves, counted(halves), options.samples)
        for wanted in (0.02, 0.01, 0.007, 0.004):
            reached = [t for t, off in ours if off <= wanted]
            peer, beyond = seconds_at(wanted, theirs)
            note = " (Mitsuba extrapolated)" if beyond else ""
            if reached:
                best = min(reached)
                print(f"  at {wanted * 100:.1f} %: {peer:.2f} s against {best:.3f} s: {peer / best:.0f} times{note}")
            else:
                print(f"  at {wanted * 100:.1f} %: {peer:.2f} s{note}; no step of Footlight is that exact")


if __name__ == "__main__":
    main()
