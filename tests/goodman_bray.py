"""The toppling slope of Goodman and Bray (1976): its columns as a scene, and its closed form.

Sixteen columns 10 m wide on steps of 1 m, whose base rises at 30 degrees; the slope is 92.5 m high.
The closed form is the recursion of the forces from column to column in Wyllie and Mah (2004),
chapter 9, at limit equilibrium.
"""

import math

import numpy as np
from scene_text import block, coulomb, lines

BASE_DIP = math.radians(30.0)
WIDTH = 10.0  # m
UNIT_WEIGHT = 25e3  # N/m3
RISE_BELOW, RISE_ABOVE, STEP = 5.0, 5.2, 1.0  # m: of heights below and above the crest, and of base
DEPTH = 20.0  # m: of the base
ANCHOR_LENGTH = 25.0  # m
COLUMNS = 16
CREST = 10  # number of the column at the crest
HEIGHTS = [0.0]
for number in range(1, COLUMNS + 1):
    HEIGHTS.append(
        number * (RISE_BELOW - STEP) if number <= CREST else HEIGHTS[-1] - RISE_ABOVE - STEP
    )


def force_on_toe(friction):
    """Force (N/m) of column 2 on column 1, parallel to the base, at a coefficient of friction."""
    force = 0.0
    for number in range(COLUMNS, 1, -1):
        height = HEIGHTS[number]
        weight = UNIT_WEIGHT * WIDTH * height
        above = height if number < CREST else height - RISE_ABOVE
        below = height - RISE_BELOW if number <= CREST else height
        moment = 0.5 * weight * (height * math.sin(BASE_DIP) - WIDTH * math.cos(BASE_DIP))
        toppling = (force * (above - WIDTH * friction) + moment) / below
        slide = weight * (friction * math.cos(BASE_DIP) - math.sin(BASE_DIP))
        force = max(toppling, force - slide / (1 - friction**2), 0.0)
    return force


def anchor_force(friction, plunge, height):
    """Tension (N/m) of an anchor in column 1 that limit equilibrium needs.

    plunge (rad): below the horizontal, into the slope; height (m): of the anchor above the base.
    """
    force = force_on_toe(friction)
    weight = UNIT_WEIGHT * WIDTH * HEIGHTS[1]
    slide = weight * (friction * math.cos(BASE_DIP) - math.sin(BASE_DIP))
    sliding = (force * (1 - friction**2) - slide) / (
        friction * math.sin(BASE_DIP + plunge) + math.cos(BASE_DIP + plunge)
    )
    moment = 0.5 * weight * (HEIGHTS[1] * math.sin(BASE_DIP) - WIDTH * math.cos(BASE_DIP))
    toppling = moment + force * (HEIGHTS[1] - WIDTH * friction)
    return max(sliding, toppling / (height * math.cos(BASE_DIP + plunge)), 0.0)


def limit_friction():
    """Coefficient of friction at limit equilibrium without an anchor (0.7855)."""
    low, high = math.tan(math.radians(25)), math.tan(math.radians(44))
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if anchor_force(middle, 0.0, 1.0) > 0 else (low, middle)
    return high


def in_world(along, across):
    """Point (m) that lies `along` the base and `across` it; the slope falls to the right."""
    cosine, sine = math.cos(BASE_DIP), math.sin(BASE_DIP)
    return [-along * cosine + across * sine, along * sine + across * cosine]


def counter_clockwise(corners):
    x, y = np.transpose(corners)
    is_positive = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() > 0
    return corners if is_positive else corners[::-1]


def scene_text(friction, normal=1e9, shear=1e9, anchor=None):
    """The scene. anchor: keys of its bolt beside `from` and `to`, with `plunge` and `height`."""
    text = lines(gravity=[0.0, -9.81], density=UNIT_WEIGHT / 9.81)
    text += "[laws.joint]\n" + coulomb(friction, normal, shear)
    for number in range(1, COLUMNS + 1):
        left, right = (number - 1) * WIDTH, number * WIDTH
        bottom = (number - 1) * STEP
        for name, low, high in (
            (f"column {number}", bottom, bottom + HEIGHTS[number]),
            (f"base {number}", bottom - DEPTH, bottom),
        ):
            places = [(left, low), (left, high), (right, high), (right, low)]
            corners = counter_clockwise([in_world(*place) for place in places])
            text += block(name, corners=corners, fixed=name.startswith("base"))
    if anchor:
        keys = dict(anchor)
        plunge, height = keys.pop("plunge"), keys.pop("height")
        head = np.array(in_world(0.0, height))
        anchored = head + ANCHOR_LENGTH * np.array([-math.cos(plunge), -math.sin(plunge)])
        text += "[[bolt]]\n" + lines(**{"from": head, "to": anchored}, **keys)
    return text + "[run]\nend = 1.0\n"
