"""A direct shear test on granite in Kratos: `python kratos.py` writes kratos.csv.

Two blocks with one interface element between them, in plane strain. The box holds the sides of both
blocks: it presses to @NORMAL@ Pa in 10 steps, then shears to @SHEAR@ m in 40 steps and half of the
way back in 20. Needs KratosMultiphysics and KratosGeoMechanicsApplication.
"""

from pathlib import Path

import KratosMultiphysics as Kratos
from KratosMultiphysics import GeoMechanicsApplication  # noqa: F401 - the element and the law
from KratosMultiphysics import StructuralMechanicsApplication as Structural

HERE = Path(__file__).resolve().parent
NORMAL, SHEAR = float("@NORMAL@"), float("@SHEAR@")  # Pa, m
PRESSED, TURN, END = 10, 50, 70  # steps
LENGTH, HEIGHT = 1.0, 0.05  # m: of the joint, and of a block
YOUNG, POISSON = float("@YOUNG@"), float("@POISSON@")  # of the rock: Pa, -
# UPwSmallStrainInterfaceElement2D4N hands over half of the jump and counts half of the stress;
# umat.c makes up for it. The newer Geo_ULineInterfacePlaneStrainElement2Plus2N (Kratos 10.4.4) hands
# over all, but never keeps the new state of a law: each step would start from the virgin joint.
SHARE = 0.5
STATE = int("@STATE@")  # numbers of state of the joint, at the start zeros
NODAL = (
    "DISPLACEMENT",
    "REACTION",
    "VELOCITY",
    "ACCELERATION",
    "VOLUME_ACCELERATION",
    "WATER_PRESSURE",
    "DT_WATER_PRESSURE",
)


# Kratos asks for the water in a joint, too; its pressure stays zero here, so that it has no part
WATER = {
    "GEO_DRAINAGE_TYPE": "DRAINED",
    "MINIMUM_JOINT_WIDTH": 1e-3,
    "TRANSVERSAL_PERMEABILITY": 1e-12,
    "DYNAMIC_VISCOSITY": 1e-3,
    "BULK_MODULUS_FLUID": 2e9,
    "BULK_MODULUS_SOLID": YOUNG,
    "DENSITY_WATER": 1e3,
    "DENSITY_SOLID": 2.7e3,
    "POROSITY": 0.1,
}


def variable(name):
    return Kratos.KratosGlobals.GetVariable(name)


def properties(part, number, law, **values):
    new = part.CreateNewProperties(number)
    new.SetValue(Kratos.CONSTITUTIVE_LAW, Kratos.KratosGlobals.GetConstitutiveLaw(law).Clone())
    for name, value in values.items():
        new.SetValue(variable(name), value)
    return new


def mesh(model):
    """The part that holds all, and its nodes: the bottom, both faces of the joint, the top."""
    part = model.CreateModelPart("rock")
    part.ProcessInfo[Kratos.DOMAIN_SIZE] = 2
    for name in NODAL:
        part.AddNodalSolutionStepVariable(variable(name))
    rock = properties(
        part, 1, "LinearElasticPlaneStrain2DLaw", YOUNG_MODULUS=YOUNG, POISSON_RATIO=POISSON
    )
    joint = properties(
        part,
        2,
        "SmallStrainUMAT2DInterfaceLaw",
        UDSM_NAME=str(HERE / "libgranite_umat.so"),
        IS_FORTRAN_UDSM=True,  # the name of the function is umat_
        UMAT_PARAMETERS=Kratos.Vector([SHARE]),
        STATE_VARIABLES=Kratos.Vector([0.0] * STATE),
        **WATER,
    )
    levels = []
    for y in (0.0, HEIGHT, HEIGHT, 2.0 * HEIGHT):
        first = part.NumberOfNodes() + 1
        levels.append([part.CreateNewNode(first + i, i * LENGTH, y, 0.0) for i in range(2)])
    (a, b), (c, d), (e, f), (g, h) = [[node.Id for node in level] for level in levels]
    part.CreateNewElement("SmallDisplacementElement2D4N", 1, [a, b, d, c], rock)
    part.CreateNewElement("SmallDisplacementElement2D4N", 2, [e, f, h, g], rock)
    part.CreateNewElement("UPwSmallStrainInterfaceElement2D4N", 3, [c, d, f, e], joint)
    for number, node in enumerate((g, h), 1):
        part.CreateNewCondition("PointLoadCondition2D1N", number, [node], rock)
    return part, levels


def newton(part):
    """Newton's method to nine digits of the displacements."""
    tools = Kratos.VariableUtils()
    for name in "XYZ":
        tools.AddDof(variable(f"DISPLACEMENT_{name}"), variable(f"REACTION_{name}"), part)
    tools.AddDof(Kratos.WATER_PRESSURE, part)
    for fixed in (Kratos.DISPLACEMENT_X, Kratos.DISPLACEMENT_Z, Kratos.WATER_PRESSURE):
        tools.ApplyFixity(fixed, True, part.Nodes)
    strategy = Kratos.ResidualBasedNewtonRaphsonStrategy(
        part,
        Kratos.ResidualBasedIncrementalUpdateStaticScheme(),
        Kratos.DisplacementCriteria(1e-9, 1e-15),
        Kratos.ResidualBasedEliminationBuilderAndSolver(Kratos.SkylineLUFactorizationSolver()),
        30,  # iterations at most
        False,  # no reactions
        False,  # the unknowns stay the same
        False,  # nor do the nodes move: small displacements
    )
    strategy.SetEchoLevel(0)
    strategy.Initialize()
    strategy.Check()
    return strategy


def main():
    Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
    model = Kratos.Model()
    part, levels = mesh(model)
    local_stress = variable("LOCAL_STRESS_VECTOR")
    strategy, joint, info = newton(part), part.GetElement(3), part.ProcessInfo
    for node in levels[0] + levels[1]:
        node.Fix(Kratos.DISPLACEMENT_Y)
    rows = ["slip_m,opening_m,shear_Pa,normal_Pa,iterations"]
    for step in range(1, END + 1):
        part.CloneTimeStep(float(step))
        info[Kratos.STEP] = step
        force = NORMAL * LENGTH / 2 * min(step / PRESSED, 1.0)
        for load in part.Conditions:
            load.SetValue(Structural.POINT_LOAD, [0.0, -force, 0.0])
        slip = SHEAR * min(max(step - PRESSED, 0), 2 * TURN - PRESSED - step) / (TURN - PRESSED)
        for node in levels[2] + levels[3]:
            node.SetSolutionStepValue(Kratos.DISPLACEMENT_X, slip)
        strategy.InitializeSolutionStep()
        strategy.Predict()
        if not strategy.SolveSolutionStep():
            raise SystemExit(f"step {step} did not converge")
        strategy.FinalizeSolutionStep()
        (stress, *_) = joint.CalculateOnIntegrationPoints(local_stress, info)
        below, above = (level[0].GetSolutionStepValue(Kratos.DISPLACEMENT) for level in levels[1:3])
        jump = above - below
        values = (jump[0], jump[1], SHARE * stress[0], SHARE * stress[1])
        rows.append(",".join(map(str, [*values, info[Kratos.NL_ITERATION_NUMBER]])))
    (HERE / "kratos.csv").write_text("\n".join([*rows, ""]))


if __name__ == "__main__":
    main()
