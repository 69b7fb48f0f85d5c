"""A direct shear test on granite in Kratos: `python kratos.py` in its folder writes kratos.csv.

Two blocks with one interface element between them (kratos.mdpa, kratos.json), in plane strain. The
box holds the sides of both blocks: it presses to @NORMAL@ Pa in 10 steps, shears to @SHEAR@ m in 40
and half of the way back in 20. Needs KratosMultiphysics and KratosGeoMechanicsApplication.
"""

from pathlib import Path

import KratosMultiphysics as Kratos
from KratosMultiphysics import GeoMechanicsApplication  # noqa: F401 - the element and the law
from KratosMultiphysics import StructuralMechanicsApplication as Structural

NORMAL, SHEAR = float("@NORMAL@"), float("@SHEAR@")  # Pa, m
PRESSED, TURN, END = 10, 50, 70  # steps
# The element hands over half of the jump and counts half of the stress. umat.c makes up for it by
# UMAT_PARAMETERS. The newer Geo_ULineInterfacePlaneStrainElement2Plus2N (Kratos 10.4.4) hands over
# all, but never keeps the new state of a law: each step would start from the virgin joint.
SHARE = 0.5

model = Kratos.Model()
Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
variable = Kratos.KratosGlobals.GetVariable

# the mesh and its materials; water is asked for, but its pressure stays zero
part = model.CreateModelPart("rock")
info = part.ProcessInfo
info[Kratos.DOMAIN_SIZE] = 2
for name in (
    "DISPLACEMENT", "REACTION", "VELOCITY", "ACCELERATION", "VOLUME_ACCELERATION",
    "WATER_PRESSURE", "DT_WATER_PRESSURE",
):  # fmt: skip
    part.AddNodalSolutionStepVariable(variable(name))
Kratos.ModelPartIO("kratos").ReadModelPart(part)
Kratos.ReadMaterialsUtility(
    Kratos.Parameters('{"Parameters": {"materials_filename": "kratos.json"}}'), model
)
tools = Kratos.VariableUtils()
for name in "XYZ":
    tools.AddDof(variable(f"DISPLACEMENT_{name}"), variable(f"REACTION_{name}"), part)
tools.AddDof(Kratos.WATER_PRESSURE, part)
for fixed in (Kratos.DISPLACEMENT_X, Kratos.DISPLACEMENT_Z, Kratos.WATER_PRESSURE):
    tools.ApplyFixity(fixed, True, part.Nodes)
tools.ApplyFixity(Kratos.DISPLACEMENT_Y, True, part.GetSubModelPart("lower").Nodes)

# Newton's method to nine digits of the displacements
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
strategy.Check()

rows = ["slip_m,opening_m,shear_Pa,normal_Pa,iterations"]
for step in range(1, END + 1):
    part.CloneTimeStep(float(step))
    info[Kratos.STEP] = step
    for load in part.Conditions:  # two, on a joint of 1 m
        load.SetValue(Structural.POINT_LOAD, [0.0, -NORMAL / 2 * min(step / PRESSED, 1.0), 0.0])
    way = min(max(step - PRESSED, 0), 2 * TURN - PRESSED - step)
    for node in part.GetSubModelPart("upper").Nodes:
        node.SetSolutionStepValue(Kratos.DISPLACEMENT_X, SHEAR * way / (TURN - PRESSED))
    strategy.Solve()
    if not strategy.IsConverged():
        raise SystemExit(f"step {step} did not converge")
    found = part.GetElement(3).CalculateOnIntegrationPoints(variable("LOCAL_STRESS_VECTOR"), info)
    below, above = (part.GetNode(i).GetSolutionStepValue(Kratos.DISPLACEMENT) for i in (3, 5))
    row = [*(above - below)][:2] + [SHARE * found[0][i] for i in (0, 1)]
    rows.append(",".join(map(str, [*row, info[Kratos.NL_ITERATION_NUMBER]])))
Path("kratos.csv").write_text("\n".join([*rows, ""]))
