"""Tetrahedral wedges on two planes: scenes, and the factor of safety by hand (Hoek and Bray)."""

from typing import NamedTuple

import numpy as np
from scene_text import lines

from dem_demo.space.cutting import plane_normal
from dem_demo.space.solids import box


class Wedge(NamedTuple):
    """Planes as (dip, dip direction) in degrees; height of the slope in m."""

    a: tuple[float, float]
    b: tuple[float, float]
    face: tuple[float, float]
    top: tuple[float, float]
    height: float


WEDGES = [
    Wedge((45, 105), (70, 235), (65, 185), (12, 195), 20.0),
    Wedge((50, 130), (55, 230), (75, 180), (5, 180), 10.0),
    Wedge((40, 150), (40, 210), (70, 180), (0, 180), 10.0),
    Wedge((60, 110), (40, 220), (80, 170), (10, 170), 8.0),
]


def line_of(wedge):
    """Unit vector (3,) down the line of intersection."""
    line = np.cross(plane_normal(*wedge.a), plane_normal(*wedge.b))
    return -np.sign(line[2]) * line / np.linalg.norm(line)


def angle_from_dip(plane, direction):
    """Angle (degrees) of a direction in a plane from its dip line, as `rough` counts it."""
    normal = plane_normal(*plane)
    down = np.array([0.0, 0.0, -1.0]) + normal[2] * normal
    down /= np.linalg.norm(down)
    return float(np.degrees(np.arctan2(direction @ np.cross(normal, down), direction @ down)))


def wedge_text(wedge, law, rough=None, scale=1.0, gravity=9.81, turn=0.0, mirror=False):
    """A slope cut by both planes through its toe; all but the wedge is fixed.

    law: text of the table of the law. rough: angle (degrees) of axis 2 from the line of
    intersection in each plane, the same sense of rotation about the two upward normals, or None.
    turn: degrees by which all azimuths are increased. mirror: of east and west.
    """
    crest = np.cross(np.cross(plane_normal(*wedge.face), [0, 0, 1]), plane_normal(*wedge.face))
    crest *= wedge.height / crest[2]
    rock = box([12 * wedge.height] * 3)
    rock, _ = rock.split(plane_normal(*wedge.face), 0.0, -1, 1e-9)
    top = plane_normal(*wedge.top)
    rock, _ = rock.split(top, float(top @ crest), -1, 1e-9)
    corners = scale * rock.vertices
    angle = np.radians(turn)
    if mirror:
        corners = corners * [-1.0, 1.0, 1.0]
    cosine, sine = np.cos(angle), np.sin(angle)
    corners = corners @ np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]]).T
    planes = []
    fixed = []
    for plane in (wedge.a, wedge.b):
        dip, azimuth = plane
        keys = {}
        if rough is not None:
            keys["rough"] = angle_from_dip(plane, line_of(wedge)) + rough
            keys["rough"] *= -1.0 if mirror else 1.0
        azimuth = (-azimuth if mirror else azimuth) + turn
        place = {"dip": dip, "dip_direction": azimuth, "through": [0, 0, 0]}
        planes.append("[[rock.set]]\n" + lines(**place, spacing=1e4 * scale, **keys))
        fixed.append("[[rock.fixed]]\n" + lines(**place))
    text = lines(gravity=[0, 0, -gravity]) + "[laws.joint]\n" + law
    text += "[[rock]]\n" + lines(name="slope", corners=corners, min_width=1e-6 * scale)
    return text + "".join(planes + fixed)


def factor_by_hand(wedge, weight, areas, friction, cohesion=0.0):
    """Factor of safety of a wedge that slides along the line of intersection.

    weight (N); areas (2,) in m2; friction: tangent of the friction angle; cohesion (Pa).
    """
    axes = np.column_stack([plane_normal(*wedge.a), plane_normal(*wedge.b), line_of(wedge)])
    normal_a, normal_b, drive = np.linalg.solve(axes, [0.0, 0.0, weight])
    assert min(normal_a, normal_b) > 0
    return ((normal_a + normal_b) * friction + cohesion * sum(areas)) / -drive
