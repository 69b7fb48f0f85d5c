"""Every key of a scene in space is felt: another value changes what `run` or `check` gives.

As `test_keys_felt.py` for the plane. A key without a probe fails `test_every_key_has_a_probe`.
"""

import json
import re
from functools import cache

import pytest
from test_keys_felt import changed, key_paths

import dem_demo.cli
from dem_demo.space.keys import SCENE
from dem_demo.space.read import load

REFUSED = "not there yet for blocks in space"
PLAIN = {"kind": "coulomb", "normal_stiffness": 1e9, "shear_stiffness": 5e8, "friction": 0.3}
STRONG = PLAIN | {"normal_stiffness": 2e9, "friction": 0.9}
# The rough direction matters to an anisotropic law only
ROUGH = {
    "asperity_density": 1e4,
    "mating_length": 2e-3,
    "orientation": {"a": 3.0, "b": 0.5, "c": 0.1},
    "asperity": {"K": 9.5e6, "lam": 1.2, "eta": 0.5, "mu": 0.4},
    "heights": {"alpha": 3.82, "beta": 1.15e-3, "overlap": 3e-3},
    "resolution": "fast",
}
LAWS = {"plain": PLAIN, "strong": STRONG}
BASE = {"name": "base", "box": [4.0, 4.0, 1.0], "at": [0.5, 0.4, -0.5], "fixed": True}
ONE = {"name": "one", "box": [1.0, 0.8, 0.5], "at": [0.0, 0.0, 0.25]}
TWO = {"name": "two", "box": [0.5, 0.6, 0.4], "at": [0.1, 0.0, 0.7]}
ON_EDGE = {
    "name": "on edge",
    "corners": [[0.0, y, 0.0] for y in (-0.3, 0.3)]
    + [[x, y, 0.5] for x in (-0.5, 0.6) for y in (-0.3, 0.3)],
}
CORNERS = [[x, y, z] for x in (-0.1, 0.3) for y in (-0.2, 0.2) for z in (0.5, 0.9)]
BLOCKS = {
    "title": "blocks",
    "gravity": [0.3, 0.2, -9.81],
    "density": 2600.0,
    "law": "plain",
    "laws": LAWS,
    "block": [BASE, ONE, TWO],
}
SOLID = "".join(
    f"v {x} {y} {z}\n" for x in (-0.1, 0.3) for y in (-0.2, 0.2) for z in (0.5, 0.9)
) + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"  # fmt: skip
FILES = {"one.obj": SOLID, "two.obj": SOLID.replace("0.3", "0.4")}
SET = {
    "dip": 0.0, "dip_direction": 90.0, "spacing": 0.5, "scatter": 0.2, "persistence": 0.9,
    "law": "plain",
}  # fmt: skip
CROSS = SET | {"dip": 80.0, "spacing": 0.7, "through": [1.0, 0.5, 0.0]}
REGION = {"box": [3.0, 3.0, 0.8], "at": [1.0, 0.5, 0.0]}
BELOW = {"dip": 10.0, "dip_direction": 90.0, "through": [0.0, 0.0, 0.6]}
LOW = [[x, y, z] for x in (-1.0, 3.0) for y in (-1.0, 2.0) for z in (-1.0, 0.4)]
ROCK = {
    "name": "rock",
    "box": [2.0, 1.0, 1.4],
    "at": [1.0, 0.5, 0.7],
    "set": [SET, CROSS],
    "fixed": [REGION],
    "density": 2600.0,
    "seed": 1,
    "min_width": 0.1,
}
SHAPELESS = {key: value for key, value in ROCK.items() if key not in ("box", "at")}
PRISM = [[x, y, z] for x in (0.0, 2.0) for y in (0.0, 1.0) for z in (0.0, 1.4)]
WEDGE = [corner if corner != [2.0, 1.0, 1.4] else [2.0, 1.0, 1.6] for corner in PRISM]
CUT = {"laws": LAWS, "gravity": [0.3, 0.2, -9.81], "rock": [ROCK]}
TURNED = {
    "laws": {"rough": ROUGH},
    "rough": 0.0,
    "gravity": [0.3, 0.2, -9.81],
    "block": [BASE, ONE],
}
WET = BLOCKS | {
    "gravity": [0.0, 0.0, -9.81],
    "water": {"table": [[0.0, 0.0, 0.2]], "unit_weight": 9810.0},
}
# The load slides the lower block where the water bears much of its weight
RISING = WET | {
    "block": [BASE, ONE | {"load": [3000.0, 0.0, 0.0]}, TWO],
    "water": {
        "table": [[0.0, 0.0, 0.2]],
        "at": [{"time": 1.0, "table": [[0.0, 0.0, 3.0]]}],
    },
}
JOINTED = TURNED | {
    "law": "plain",
    "laws": TURNED["laws"] | LAWS,
    "block": [BASE, ONE, TWO],
    "joint": [{"between": ["base", "one"], "law": "rough", "rough": 0.0}],
}


IN_SITU = {
    "laws": LAWS,
    "rock": [
        {
            "name": "rock",
            "box": [3.0, 3.0, 3.0],
            "at": [0.0, 0.0, 1.5],
            "set": [
                {"dip": 0.0, "dip_direction": 0.0, "spacing": 1.0},
                {"dip": 90.0, "dip_direction": 90.0, "spacing": 1.0, "through": [0.5, 0.0, 0.0]},
                {"dip": 90.0, "dip_direction": 0.0, "spacing": 1.0, "through": [0.0, 0.5, 0.0]},
            ],
        }
    ],
    "in_situ": {"k0": 0.8, "surface": [[0.0, 0.0, 20.0]], "bottom": "fixed"}
    | dict.fromkeys(("left", "right", "front", "back"), "rollers")
    | {"top": "loaded"},
}
UNIFORM = IN_SITU | {
    "in_situ": {
        key: value for key, value in IN_SITU["in_situ"].items() if key not in ("k0", "surface")
    }
    | {"stress": [2e5, 2e5, 1e5, 0.0, 0.0, 0.0]}
}
STAGE = {"box": [0.9, 0.9, 1.0], "at": [0.0, 0.0, 1.5], "start": 1.0, "release_time": 0.1}
DUG = IN_SITU | {"excavate": [STAGE]}
PART = {key: value for key, value in STAGE.items() if key not in ("box", "at")}
DUG_PRISM = [[x, y, z] for x in (-0.45, 0.45) for y in (-0.45, 0.45) for z in (1.0, 2.0)]


TOSSED = TWO | {"at": [0.1, 0.0, 0.701], "velocity": [0.1, 0.0, -0.2], "spin": [0.1, 0.2, 0.3]}
MOVING = BLOCKS | {
    "block": [BASE, ONE, TOSSED],
    "run": {
        "end": 0.015, "fraction": 0.2, "settle": False, "record": 3e-3, "dashpot_normal": 0.05,
        "dashpot_shear": 0.05, "law_steps": 1,
    },
}  # fmt: skip


DRIVEN = MOVING | {
    "drive": [
        {
            "block": "base",
            "motion": "turn_y",
            "times": [0.0, 0.01],
            "values": [0.0, 1e-4],
            "ramp": 0.01,
        }
    ]
}
SINE = {"acceleration": 2.0, "frequency": 100.0, "cycles": 2}
FILES |= {
    f"{name}.csv": "time_s,acc_m/s2\n0,0\n" + f"0.004,{value}\n0.01,0.5\n"
    for name, value in (("one", 1.0), ("two", -2.0))
}


def shaken(**keys):
    """A scene whose fixed block is shaken along x."""
    return MOVING | {"drive": [{"motion": "x"} | keys]}


def with_run(**keys):
    """A scene whose blocks move, with these settings of the run beside its end."""
    return MOVING | {"run": {"end": 1e-3} | keys}


def with_rock(**keys):
    """A scene with a rock that differs in some keys."""
    return CUT | {"rock": [ROCK | keys]}


def with_set(**keys):
    """A scene with an anisotropic rock whose steep set differs in some keys."""
    rock = ROCK | {"set": [SET | {"law": "rough", "rough": 0.0}, CROSS | keys]}
    return CUT | {"laws": LAWS | {"rough": ROUGH}, "rock": [rock]}


def with_region(region):
    return CUT | {"rock": [ROCK | {"fixed": [region]}]}


PROBES = {  # path of the key: scene, where the key is in it, another value
    "title": (BLOCKS, "title", "others"),
    "gravity": (BLOCKS, "gravity", [0.3, 0.2, -9.0]),
    "seismic": (BLOCKS, "seismic", [0.01, 0.0, 0.0]),
    "density": (BLOCKS, "density", 2500.0),
    "law": (BLOCKS, "law", "strong"),
    "rough": (TURNED, "rough", 90.0),
    "laws": (BLOCKS, "laws.plain.friction", 0.01),
    "laws.NAME.pressure": (BLOCKS, "laws.plain.pressure", 2e3),
    "block.name": (BLOCKS, "block.1.name", "uno"),
    "block.box": (BLOCKS, "block.2.box", [0.6, 0.6, 0.4]),
    "block.at": (BLOCKS, "block.2.at", [0.2, 0.0, 0.7]),
    "block.corners": (
        BLOCKS | {"block": [BASE, ONE, {"name": "two", "corners": CORNERS}]},
        "block.2.corners.7",
        [0.3, 0.2, 1.0],
    ),
    "block.file": (
        BLOCKS | {"block": [BASE, ONE, {"name": "two", "file": "one.obj"}]},
        "block.2.file",
        "two.obj",
    ),
    "block.density": (BLOCKS, "block.2.density", 2500.0),
    "block.fixed": (BLOCKS, "block.1.fixed", True),
    "block.load": (BLOCKS, "block.1.load", [0.0, 0.0, -100.0]),
    "block.velocity": (MOVING, "block.2.velocity", [0.1, 0.0, 0.2]),
    "block.spin": (MOVING, "block.2.spin", [0.1, 0.3, 0.2]),
    "rock.name": (CUT, "rock.0.name", "other"),
    "rock.box": (CUT, "rock.0.box", [2.0, 1.0, 1.5]),
    "rock.at": (CUT, "rock.0.at", [1.1, 0.5, 0.7]),
    "rock.corners": (
        CUT | {"rock": [SHAPELESS | {"corners": PRISM}]}, "rock.0.corners", WEDGE,
    ),
    "rock.file": (
        CUT | {"rock": [SHAPELESS | {"file": "one.obj", "fixed": [BELOW]}]},
        "rock.0.file",
        "two.obj",
    ),
    "rock.set.dip": (CUT, "rock.0.set.1.dip", 75.0),
    "rock.set.dip_direction": (CUT, "rock.0.set.1.dip_direction", 80.0),
    "rock.set.spacing": (CUT, "rock.0.set.1.spacing", 0.8),
    "rock.set.law": (CUT, "rock.0.set.0.law", "strong"),
    "rock.set.through": (CUT, "rock.0.set.1.through", [1.1, 0.5, 0.0]),
    "rock.set.persistence": (CUT, "rock.0.set.1.persistence", 0.1),
    "rock.set.rough": (with_set(), "rock.0.set.0.rough", 90.0),
    "rock.set.scatter": (CUT, "rock.0.set.0.scatter", 0.1),
    "rock.fixed.box": (CUT, "rock.0.fixed.0.box", [3.0, 3.0, 2.4]),
    "rock.fixed.at": (CUT, "rock.0.fixed.0.at", [1.0, 0.5, 0.9]),
    "rock.fixed.corners": (
        with_region({"corners": LOW}),
        "rock.0.fixed.0.corners",
        [[x, y, 2.5 * z if z > 0 else z] for x, y, z in LOW],
    ),
    "rock.fixed.dip": (with_region(BELOW), "rock.0.fixed.0.dip", 30.0),
    "rock.fixed.dip_direction": (
        with_region(BELOW | {"dip": 30.0}), "rock.0.fixed.0.dip_direction", 270.0,
    ),
    "rock.fixed.through": (with_region(BELOW), "rock.0.fixed.0.through", [0.0, 0.0, 1.2]),
    "rock.density": (CUT, "rock.0.density", 2500.0),
    "rock.seed": (CUT, "rock.0.seed", 2),
    "rock.min_width": (CUT, "rock.0.min_width", 0.3),
    "rock.laws": (CUT, "rock.0.laws", {"plain": "strong"}),
    "joint.between": (JOINTED, "joint.0.between", ["one", "two"]),
    "joint.law": (JOINTED, "joint.0.law", "strong"),
    "joint.rough": (JOINTED, "joint.0.rough", 90.0),
    "water.table": (WET, "water.table", [[0.0, 0.0, 0.1]]),
    "water.unit_weight": (WET, "water.unit_weight", 9000.0),
    "water.at.time": (RISING, "water.at.0.time", 2.0),
    "water.at.table": (RISING, "water.at.0.table", [[0.0, 0.0, 0.3]]),
    "in_situ.k0": (IN_SITU, "in_situ.k0", [0.8, 1.0]),
    "in_situ.stress": (UNIFORM, "in_situ.stress", [2e5, 2e5, 1.1e5, 0.0, 0.0, 0.0]),
    "in_situ.surface": (IN_SITU, "in_situ.surface", [[0.0, 0.0, 25.0]]),
    **{
        f"in_situ.{side}": (IN_SITU, f"in_situ.{side}", "fixed")
        for side in ("left", "right", "front", "back", "top")
    },
    "in_situ.bottom": (IN_SITU, "in_situ.bottom", "rollers"),
    "excavate.box": (DUG, "excavate.0.box", [1.0, 1.0, 1.0]),
    "excavate.at": (DUG, "excavate.0.at", [0.1, 0.0, 1.5]),
    "excavate.corners": (
        IN_SITU | {"excavate": [PART | {"corners": DUG_PRISM}]},
        "excavate.0.corners",
        [[x, y, 1.1 * z] for x, y, z in DUG_PRISM],
    ),
    "excavate.start": (DUG, "excavate.0.start", 2.0),
    "excavate.release_time": (DUG, "excavate.0.release_time", 0.2),
    "block.fixed_motions": (MOVING, "block.2.fixed_motions", ["turn"]),
    "drive.block": (DRIVEN, "drive.0.block", "one"),
    "drive.motion": (DRIVEN, "drive.0.motion", "turn_x"),
    "drive.times": (DRIVEN, "drive.0.times", [0.0, 0.02]),
    "drive.values": (DRIVEN, "drive.0.values", [0.0, 2e-4]),
    "drive.ramp": (DRIVEN, "drive.0.ramp", 0.02),
    "drive.sine.acceleration": (shaken(sine=SINE), "drive.0.sine.acceleration", 3.0),
    "drive.sine.frequency": (shaken(sine=SINE), "drive.0.sine.frequency", 90.0),
    "drive.sine.cycles": (shaken(sine=SINE | {"frequency": 400.0}), "drive.0.sine.cycles", 3),
    "drive.file": (shaken(file="one.csv"), "drive.0.file", "two.csv"),
    "drive.scale": (shaken(file="one.csv", scale=1.0), "drive.0.scale", 2.0),
    "drive.baseline": (shaken(file="one.csv", baseline=False), "drive.0.baseline", True),
    "monitor.points": (
        MOVING | {"monitor": {"points": [[0.1, 0.0, 0.8]]}},
        "monitor.points.0",
        [0.2, 0.0, 0.8],
    ),
    "run.end": (MOVING, "run.end", 0.02),
    "run.fraction": (MOVING, "run.fraction", 0.1),
    "run.step": (with_run(step=1e-5), "run.step", 5e-6),
    "run.settle": (MOVING, "run.settle", True),
    "run.record": (MOVING, "run.record", 1e-3),
    "run.dashpot_normal": (MOVING, "run.dashpot_normal", 0.1),
    "run.dashpot_shear": (MOVING, "run.dashpot_shear", 0.1),
    "run.law_steps": (MOVING, "run.law_steps", 2),
    "run.corner_length": (
        BLOCKS | {"block": [BASE, ON_EDGE], "run": {"corner_length": 0.02}},
        "run.corner_length",
        0.03,
    ),
    "run.skin": (
        BLOCKS | {"block": [BASE, ONE, TWO | {"at": [0.1, 0.0, 0.71]}], "run": {"skin": 0.1}},
        "run.skin",
        1e-3,
    ),
    "run.max_overlap": (
        BLOCKS | {"block": [BASE, ONE | {"at": [0.0, 0.0, 0.249]}], "run": {"max_overlap": 0.1}},
        "run.max_overlap",
        1e-4,
    ),
}  # fmt: skip


PRESENT = {}  # outcomes of scenes as they are, which several probes share


def toml(value):
    """A value in TOML, tables in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml, value))}]"
    return json.dumps(value)


def outcome(tables, folder, capsys):
    """What a run and a check of a scene print and write, and their errors."""
    folder.mkdir()
    for name, text in FILES.items():
        (folder / name).write_text(text)
    scene = folder / "scene.toml"
    scene.write_text("".join(f"{key} = {toml(value)}\n" for key, value in tables.items()))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dem_demo.cli, "load", cache(load))  # of both commands
        status = dem_demo.cli.main(["check", str(scene)])
        results = str(folder / "out")
        dem_demo.cli.main(["run", str(scene), "--no-pictures", "--vtk", "--out", results])
    texts = {
        path.relative_to(folder).as_posix(): re.sub('"wall_time_s": .*', "", path.read_text())
        for path in sorted((folder / "out").rglob("*"))
        if path.suffix in (".csv", ".json", ".vtu")
    }
    printed = capsys.readouterr()
    out = re.sub("estimated .*", "", printed.out).replace(str(folder), "")
    return status, out, printed.err.replace(str(folder), ""), texts


def is_refused(path):
    """Whether no scene in space may have a key yet."""
    rules = SCENE
    for part in path.split("."):
        rule = rules.get(part, rules.get(f"{part}!"))
        rules = rule[0] if isinstance(rule, list) else rule
    try:
        rule("key", None)
    except ValueError as error:
        return REFUSED in str(error)
    except TypeError:
        return False
    return False


def test_every_key_has_a_probe():
    paths = {path for path in key_paths(SCENE) if not is_refused(path)}
    assert paths == {path for path in PROBES if not path.startswith("laws.NAME")}


@pytest.mark.parametrize("path", PROBES)
def test_every_key_is_felt(path, tmp_path, capsys):
    scene, place, value = PROBES[path]
    key = json.dumps(scene)
    if key not in PRESENT:
        PRESENT[key] = outcome(scene, tmp_path / "one", capsys)
    status, _, error, _ = PRESENT[key]
    assert status == 0, error
    assert outcome(changed(scene, place, value), tmp_path / "two", capsys) != PRESENT[key]
