"""A direct shear test on granite in Kratos: `python kratos.py` in its folder writes kratos.csv.

Two blocks with one interface element between them (kratos.mdpa, kratos.json), in plane strain. The
shear box fixes the sides of both blocks. It loads the joint to @NORMAL@ Pa in 10 steps, shears it
to @SHEAR@ m in 40 steps and reverses half of the slip in 20 steps. Needs
KratosMultiphysics and KratosGeoMechanicsApplication.
"""

from pathlib import Path

import KratosMultiphysics as Kratos
from KratosMultiphysics import GeoMechanicsApplication  # noqa: F401 - the element and the law
from KratosMultiphysics import StructuralMechanicsApplication as Structural

NORMAL_STRESS = float("@NORMAL@")  # Pa
SHEAR = float("@SHEAR@")  # m
LOADED_STEP = 10  # last step of loading
REVERSAL_STEP = 50  # last step of shear before the reversal
LAST_STEP = 70
# The element passes half of the jump to the law and takes half of its stress; umat.c compensates by
# UMAT_PARAMETERS. The newer Geo_ULineInterfacePlaneStrainElement2Plus2N (Kratos 10.4.4) passes the
# whole jump, but never stores the new state of a law: each step would start from the virgin joint.
STRESS_FRACTION = 0.5

model = Kratos.Model()
Kratos.Logger.GetDefaultOutput().SetSeverity(Kratos.Logger.Severity.WARNING)
variable = Kratos.KratosGlobals.GetVariable

# the mesh and its materials; the element requires water pressure, which stays zero
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
for degree_of_freedom in (Kratos.DISPLACEMENT_X, Kratos.DISPLACEMENT_Z, Kratos.WATER_PRESSURE):
    tools.ApplyFixity(degree_of_freedom, True, part.Nodes)
tools.ApplyFixity(Kratos.DISPLACEMENT_Y, True, part.GetSubModelPart("lower").Nodes)

# Newton's method, to a relative accuracy of 1e-9 of the displacements
strategy = Kratos.ResidualBasedNewtonRaphsonStrategy(
    part,
    Kratos.ResidualBasedIncrementalUpdateStaticScheme(),
    Kratos.DisplacementCriteria(1e-9, 1e-15),
    Kratos.ResidualBasedEliminationBuilderAndSolver(Kratos.SkylineLUFactorizationSolver()),
    30,  # maximum number of iterations
    False,  # compute reactions
    False,  # reform the degrees of freedom in every step
    False,  # move the mesh: no, small displacements
)
strategy.SetEchoLevel(0)
strategy.Check()

rows = ["slip_m,opening_m,shear_Pa,normal_Pa,iterations"]
for step in range(1, LAST_STEP + 1):
    part.CloneTimeStep(float(step))
    info[Kratos.STEP] = step
    for load in part.Conditions:  # two, on a joint of 1 m
        load.SetValue(
            Structural.POINT_LOAD, [0.0, -NORMAL_STRESS / 2 * min(step / LOADED_STEP, 1.0), 0.0]
        )
    sheared_steps = min(max(step - LOADED_STEP, 0), 2 * REVERSAL_STEP - LOADED_STEP - step)
    shear = SHEAR * sheared_steps / (REVERSAL_STEP - LOADED_STEP)
    for node in part.GetSubModelPart("upper").Nodes:
        node.SetSolutionStepValue(Kratos.DISPLACEMENT_X, shear)
    strategy.Solve()
    if not strategy.IsConverged():
        raise SystemExit(f"step {step} did not converge")
    element = part.GetElement(3)
    stress = element.CalculateOnIntegrationPoints(variable("LOCAL_STRESS_VECTOR"), info)[0]
    below, above = (part.GetNode(i).GetSolutionStepValue(Kratos.DISPLACEMENT) for i in (3, 5))
    row = [*(above - below)][:2] + [STRESS_FRACTION * stress[i] for i in (0, 1)]
    rows.append(",".join(map(str, [*row, info[Kratos.NL_ITERATION_NUMBER]])))
Path("kratos.csv").write_text("\n".join([*rows, ""]))
