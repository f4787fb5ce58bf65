"""Banks by an outside renderer that reads the scene, against the references: is each within 2 % beyond noise?

    python3 tests/peers/outside_banks.py REFS --renderer 'mitsuba --samples 16'
    python3 tests/peers/outside_banks.py REFS --renderer 'blender --samples 16' [--scenes stage cornell spots]

REFS holds a folder for each of `stage` and `cornell` with the references BANK_A.exr and BANK_B.exr. Needs the
packages `OpenEXR` and `numpy`, the renderer, and `footlight` (`--program`, `target/release/footlight`).
`spots` needs no references: a floor and a wall under two spots of our stated law, a projection and a
photometric file that is not the same all round, against our own renderer at step 2.

Each bank is rendered twice, at the first and second step of quality (four times the samples), by chance of
their own. With pictures X1, X2 and references A, B, mean (X1 - A)(X2 - B) / mean AB is free of the noise of
all four; its root is the error, below zero where chance makes the mean so. Its own chance (`by chance`) is the root of
two standard errors of that mean, for pixels that do not depend on each other. Pixels beside a lamp are left out.
"""

import argparse
import math
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR

ROOT = Path(__file__).resolve().parents[2]
# Radiance from which a pixel of the references shows a lamp.
LAMP = 2.9
ALLOWED = 0.02

SPOTS = """show "Spots"
view house from 0,-9,2.5 to 0,0,1 fov 32 size 160x90
surface floor reflectance 0.5 box from -4,-4,-0.2 to 4,4,0
surface wall reflectance 0.6,0.4,0.3 box from -4,4,0 to 4,4.2,4
light near spot at -2,-4,5 aim -0.5,2,0 beam 14 field 26 8000 cd
light slide project "window.png" from -1,-6,2.2 aim 0.4,4,1.7 field 24 9000 cd
light wings photometric "batwing.ies" at 1,1,3 aim 1,2,0 turn 30 9000 lm
light far spot at 3,-3,4 aim 0,4,1.5 beam 30 field 50 6000 cd
bank left = near
bank right = far
bank gobo = slide
bank wash = wings
cue 1 at 0:00 { snap left full right full gobo full wash full }
"""


def read(path):
    """Red, green and blue."""
    with OpenEXR.File(str(path)) as file:
        channels = file.channels()
        name = "RGB" if "RGB" in channels else "RGBA"
        return channels[name].pixels[:, :, :3].astype(np.float64)


def counted(pairs, lamp):
    """Pixels whose 3 x 3 neighbourhood shows nothing as bright as a lamp in any bank."""
    lit = np.any([half.max(axis=2) > lamp for pair in pairs for half in pair], axis=0)
    wide = np.pad(lit, 1)
    h, w = lit.shape
    near = np.any([wide[j : j + h, i : i + w] for j in range(3) for i in range(3)], axis=0)
    return ~near


def render(program, show, bank, quality, renderer, out):
    command = [program, "picture", show, "--bank", bank, "--quality", str(quality), "--float", "--quiet"]
    command += ["--pool", "off", "--renderer-timeout", "3600", "-o", out]
    if renderer:
        command += ["--renderer", renderer, "--renderer-steps", "2"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    return read(out)


def judge(name, pictures, halves, mask):
    """Prints a bank's line; is it within what is allowed?"""
    (x, y), (a, b) = ([i[mask] for i in pair] for pair in (pictures, halves))
    light = np.mean(a * b)
    products = (x - a) * (y - b)
    square = np.mean(products) / light
    chance = math.sqrt(2 * np.std(products) / math.sqrt(products.size) / light)
    error = math.copysign(math.sqrt(abs(square)), square)
    mean = np.mean(x + 4 * y) / 5 / np.mean((a + b) / 2)
    noise = [math.sqrt(np.mean((i - (a + b) / 2) ** 2) / light) for i in (x, y)]
    print(
        f"  {name:12} error {100 * error:6.2f} % (by chance {100 * chance:.2f}), mean {mean:.4f}, "
        f"as rendered {100 * noise[0]:.1f} and {100 * noise[1]:.1f} %",
        flush=True,
    )
    return error <= ALLOWED


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("references", type=Path)
    parser.add_argument("--renderer", required=True)
    parser.add_argument("--program", default=ROOT / "target/release/footlight")
    parser.add_argument("--scenes", nargs="+", default=["stage", "cornell", "spots"])
    parser.add_argument("--banks", nargs="+", help="these alone")
    options = parser.parse_args()
    good = True
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "bank.exr"
        for scene in options.scenes:
            print(f"{scene} by {options.renderer}")
            if scene == "spots":
                show = Path(folder) / "spots.lxq"
                show.write_text(SPOTS)
                for name in ("window.png", "batwing.ies"):
                    shutil.copy(ROOT / "examples/luminaires" / name, folder)
                ours = {b: render(options.program, show, b, 2, None, out) for b in ("left", "right", "gobo", "wash")}
                halves = {bank: (image, image) for bank, image in ours.items()}
            else:
                show = ROOT / f"examples/reference/{scene}/{scene}.lxq"
                found = sorted(p.name[:-6] for p in (options.references / scene).glob("*_A.exr"))
                banks = [bank for bank in found if bank != "mix"]
                path = lambda bank, half: options.references / scene / f"{bank}_{half}.exr"
                halves = {bank: tuple(read(path(bank, half)) for half in "AB") for bank in banks}
            mask = counted(halves.values(), math.inf if scene == "spots" else LAMP)
            for bank in options.banks or halves:
                pair = halves[bank]
                pictures = [render(options.program, show, bank, q, options.renderer, out) for q in (1, 2)]
                good &= judge(bank, pictures, pair, mask)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
