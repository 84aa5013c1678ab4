#!/usr/bin/env python3
"""Writes dust_##.ply: a whirl of particles that stands for what Houdini or Blender would export. It is a loop."""
import math
import pathlib
import random
import struct

FRAMES, RATE, COUNT = 16, 10, 200
LIFE = FRAMES / RATE  # seconds
FOLDER = pathlib.Path(__file__).parent

random.seed(4)
grains = [((i + random.random()) / COUNT, random.randrange(3) / 3 + random.gauss(0, 0.09), random.gauss(0, 1),
           random.uniform(0.7, 1.3)) for i in range(COUNT)]


def vertex(number, frame):
    """x y z pscale age id life of a grain, None in the one frame of the loop after which it starts anew below."""
    phase, turn, spread, size = grains[number]
    height = (phase + frame / FRAMES) % 1
    if height >= 1 - 1 / FRAMES:
        return None
    angle = 2 * math.pi * (turn + 1.6 * height)
    reach = 0.22 + 1.25 * height**2 + 0.55 * max(0, 1 - 6 * height) + 0.1 * spread * (0.4 + height)
    bend = 0.6 * math.sin(3 * height)
    radius = size * (0.3 + 0.35 * height)
    return (reach * math.cos(angle) + bend, 6 * height, reach * math.sin(angle), radius, height * LIFE, number, LIFE)


for frame in range(FRAMES + 1):
    vertices = [v for v in (vertex(number, frame) for number in range(COUNT)) if v]
    header = ("ply\nformat binary_little_endian 1.0\n"
              f"comment samples/effects/dust_devil/make.py\nelement vertex {len(vertices)}\n"
              "property float x\nproperty float y\nproperty float z\nproperty float pscale\n"
              "property float age\nproperty ushort id\nproperty float life\nend_header\n")
    rows = b"".join(struct.pack("<5fHf", *v) for v in vertices)
    (FOLDER / f"dust_{frame:02}.ply").write_bytes(header.encode() + rows)
