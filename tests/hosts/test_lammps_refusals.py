"""Invalid input and unsupported commands: a one-line error and exit status 1, on two processes."""

import pytest
from lammps_host import HEAD, run

GOOD = (
    HEAD
    + """boundary f f f
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1
create_box 2 box
create_atoms 1 single -0.0099 0 0
create_atoms 2 single 0.0099 0 0
set group all diameter 0.02 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3
pair_coeff * * rock.jlaw
neighbor 0.002 bin
timestep 1e-7
fix 1 all nve/sphere
run 2
"""
)
ATOMIC = (
    GOOD.replace("atom_style sphere", "atom_style atomic")
    .replace("set group all diameter 0.02 density 2600", "mass * 1.0")
    .replace("nve/sphere", "nve")
)
STYLE = "pair_style jointlaw opening 1e-3"
COEFF = "pair_coeff * * rock.jlaw"

# what is changed in the good script; a part of the one line that says so
CASES = {
    "file missing": (COEFF, "pair_coeff * * none.jlaw", "none.jlaw: it cannot be read"),
    "another LAMMPS": ("load .", "load ./other", "was built for LAMMPS 20240829, this is 20250722"),
    "law of a plane": (COEFF, "pair_coeff * * plane.jlaw", "a law for motion in a plane"),
    "law with a direction": (COEFF, "pair_coeff * * directed.jlaw", "has a preferred direction"),
    "two laws": (COEFF, COEFF + "\npair_coeff 1 2 block.jlaw", "types 1 2 already have a law"),
    "no law for a pair": (COEFF, "pair_coeff 1 1 rock.jlaw\npair_coeff 2 2 rock.jlaw",
                          "types 1 2 have no pair_coeff; give a law or NULL"),
    "too many words": (COEFF, COEFF + " 3", "pair_coeff for jointlaw: I J FILE.jlaw"),
    "no opening": (STYLE, "pair_style jointlaw", "opening R is missing"),
    "no area": (STYLE, STYLE + " area 0", "area 0 must be > 0 m2, or the word radius"),
    "no direction": (STYLE, STYLE + " plane 0 0 0", "plane 0 0 0 is not a direction"),
    "closure0 alone": (STYLE, STYLE + " closure0 1e-6", "closure0 requires plane"),
    "unknown keyword": (STYLE, STYLE + " reach 1", "unknown keyword reach; keywords are opening"),
    "plane without area": (STYLE, STYLE + " plane 0 0 1", "plane needs area A"),
    "plane without bodies": (STYLE, STYLE + " plane 0 0 1 area 1",
                             "needs a molecule ID for each body"),
    "newton off": ("newton on", "newton off", "needs newton on"),
    "no ghost velocities": ("comm_modify vel yes\n", "", "needs comm_modify vel yes"),
    "other units": ("units si", "units cgs", "needs units si"),
    "atom style": ("", "", "needs atom_style sphere"),
    "minimisation": ("run 2", "minimize 0 1e-6 10 10", "cannot be minimised"),
    "two time steps": ("run 2", "run_style respa 2 2 pair 1\nrun 2", "needs run_style verlet"),
    "small periodic box": ("boundary f f f\nregion box block -0.1 0.1 -0.1 0.1 -0.1 0.1",
                           "boundary p f f\nregion box block -0.02 0.02 -0.1 0.1 -0.1 0.1",
                           "two atoms would interact twice"),
    "fix by hand": (COEFF, COEFF + "\nfix 2 all jointlaw/memory", "pair_style jointlaw creates"),
    "IDs made anew": ("run 2", "run 2\nreset_atoms id", "reset_atoms id with a fix jointlaw"),
    "IDs moved up": ("run 2", "run 2\ngroup gone id 1\ndelete_atoms group gone\nrun 0",
                     "use delete_atoms compress no"),
    "central force": ("run 2", "compute 1 all group/group all\nrun 2",
                      "compute group/group assumes central forces"),
    "scaled": (f"{STYLE}\n{COEFF}", "pair_style hybrid/scaled 0.5 jointlaw opening 1e-3\n"
               "pair_coeff * * jointlaw rock.jlaw", "hybrid/scaled would scale the force"),
    "rerun": ("run 2", "dump 1 all custom 1 seen id x y z\nrun 2\nrerun seen dump x y z",
              "rerun cannot compute a joint"),
    "suffix": ("units si", "package omp 1\nsuffix omp\nunits si", "no version for the suffix omp"),
    "law changed": ("run 2", f"run 2\n{STYLE}\npair_coeff * * block.jlaw\nrun 2",
                    "there are joints of other laws"),
    "bond": (f"1e-3\n{COEFF}", "3e-5\npair_coeff * * bonded.jlaw",
             "has tensile strength up to an opening of 4"),
    "tension": (f"1e-3\n{COEFF}", "9e-6\npair_coeff * * coulomb.jlaw",
                "has tensile strength up to an opening of 1e-05 m"),
}  # fmt: skip


def test_the_good_script_runs(plugin):
    """Also found without `plugin load`, in the folder that the entry point gives to LAMMPS."""
    run(plugin, GOOD)
    run(plugin, GOOD.replace("plugin load ./jointlawplugin.so", ""), 2, plugins=plugin)


@pytest.mark.parametrize("case", CASES)
def test_one_line_and_exit_1(plugin, case):
    old, new, line = CASES[case]
    script = GOOD.replace(old, new) if old else ATOMIC
    assert script != GOOD
    lines = run(plugin, script, 2, code=1).splitlines()
    (error,) = (one for one in lines if one.startswith("ERROR"))
    assert line in error
