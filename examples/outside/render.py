"""A renderer for Footlight in plain Python: `render.py SETTINGS OUTPUT`.

Reads what to render (JSON) and leaves an OpenEXR picture: a floor (z = 0) and a back wall (y = 3),
each bank one point lamp, direct light only. Whatever renders linearly can stand in its place.
"""

import json
import math
import struct
import sys

# Position and colour of each bank's lamp; a bank that is not here is dark.
LAMPS = {
    "day": ((-3.0, -2.0, 4.0), (40.0, 40.0, 38.0)),
    "eve": ((3.0, 1.0, 2.0), (15.0, 6.0, 2.0)),
}


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def unit(a):
    length = math.sqrt(dot(a, a))
    return [x / length for x in a]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def hit(eye, ray):
    """The nearest point of floor or wall on the ray, and its normal."""
    found = []
    if ray[2] < 0:
        found.append((-eye[2] / ray[2], [0.0, 0.0, 1.0]))
    if ray[1] > 0:
        found.append(((3.0 - eye[1]) / ray[1], [0.0, -1.0, 0.0]))
    for distance, normal in sorted(found):
        point = [e + distance * r for e, r in zip(eye, ray)]
        if abs(point[0]) <= 4 and -3 <= point[1] <= 3.001 and -0.001 <= point[2] <= 4:
            return point, normal
    return None


def shade(point, normal, lamps):
    colour = [0.0, 0.0, 0.0]
    for position, strength in lamps:
        way = minus(position, point)
        square = dot(way, way)
        cosine = dot(way, normal) / math.sqrt(square)
        if cosine > 0:
            light = 0.6 / math.pi * cosine / square
            colour = [c + light * s for c, s in zip(colour, strength)]
    return colour


def write_exr(path, width, height, rows):
    """Uncompressed scan lines of 32-bit floats; channels in alphabetical order."""

    def attribute(name, kind, data):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data

    channel = lambda name: name + b"\0" + struct.pack("<iiii", 2, 0, 1, 1)
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2)
    header += attribute("channels", "chlist", channel(b"B") + channel(b"G") + channel(b"R") + b"\0")
    header += attribute("compression", "compression", b"\0")
    header += attribute("dataWindow", "box2i", window)
    header += attribute("displayWindow", "box2i", window)
    header += attribute("lineOrder", "lineOrder", b"\0")
    header += attribute("pixelAspectRatio", "float", struct.pack("<f", 1.0))
    header += attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0.0, 0.0))
    header += attribute("screenWindowWidth", "float", struct.pack("<f", 1.0)) + b"\0"
    length = 8 + width * 12
    first = len(header) + 8 * height
    with open(path, "wb") as file:
        file.write(header)
        file.write(struct.pack("<%dQ" % height, *(first + y * length for y in range(height))))
        for y, row in enumerate(rows):
            file.write(struct.pack("<ii", y, width * 12))
            for c in (2, 1, 0):
                file.write(struct.pack("<%df" % width, *(pixel[c] for pixel in row)))


def main(settings, output):
    with open(settings) as file:
        request = json.load(file)
    view = request["view"]
    width, height = view["width"], view["height"]
    lamps = [
        (LAMPS[c["name"]][0], [c["value"] * s for s in LAMPS[c["name"]][1]])
        for c in request["coordinates"]
        if c["name"] in LAMPS
    ]
    eye = view["from"]
    ahead = unit(minus(view["to"], eye))
    right = unit(cross(ahead, [0.0, 0.0, 1.0]))
    above = cross(right, ahead)
    half = math.tan(math.radians(view["fov"]) / 2)
    rows = []
    for y in range(height):
        row = []
        for x in range(width):
            u = (2 * (x + 0.5) / width - 1) * half * width / height
            v = (1 - 2 * (y + 0.5) / height) * half
            ray = [a + u * r + v * b for a, r, b in zip(ahead, right, above)]
            found = hit(eye, ray)
            row.append(shade(*found, lamps) if found else [0.0, 0.0, 0.0])
        rows.append(row)
    write_exr(output, width, height, rows)


main(*sys.argv[1:3])
