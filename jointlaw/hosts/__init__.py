"""Host codes: one folder each, and `HOSTS`, the table of all hosts of `jointlaw export`.

The command `jointlaw export`, the names of the package (`jl.export_c`), the API page and the tests
read this table. A new host needs a folder with an export function, and a line here.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple


class ExportOption(NamedTuple):
    """A quantity that an export function and the command take as an option."""

    keyword: str  # of the function; the command has --keyword, with hyphens
    unit: str  # SI
    metavar: str
    help: str
    default: float | None = None
    positive: bool = False


class Host(NamedTuple):
    """A host code that needs files.

    name: as typed after `jointlaw export`. codes: programs that read the files. contents: of the
    folder. function: that exports, in `module` of this package; it takes a law and a folder, then
    the name of the tables if `names_tables`, then `options`. run_command: what to type in the
    folder. guide: page of the documentation. report: function in `module` that describes a result
    for the user; empty: the function returns the names of the files.
    """

    name: str
    codes: str
    contents: str
    module: str
    function: str
    run_command: str
    guide: str
    names_tables: bool = True
    options: tuple[ExportOption, ...] = ()
    report: str = ""

    def load(self, name: str) -> Callable[..., Any]:
        """A function of the module of this host."""
        function: Callable[..., Any] = getattr(import_module(f".{self.module}", __name__), name)
        return function


DEFAULT_SEATING = 10e3  # Pa

HOSTS = {
    host.name: host
    for host in (
        Host(
            "yade",
            codes="YADE",
            contents="table, law, adapter, script",
            module="yade.export",
            function="export_yade",
            run_command="yade -n -x settle_and_incline.py",
            guide="particles.md#yade",
            names_tables=False,
            options=(
                ExportOption(
                    "shear_limit",
                    "m",
                    "LENGTH",
                    "shear displacement at which friction and dilation of the table are computed, "
                    "such as 5um (default: mating length, or ten closure ranges without one)",
                    positive=True,
                ),
            ),
            report="describe_table",
        ),
        Host(
            "c",
            codes="C, C++, Fortran, CUDA (GPU)",
            contents="one header, tables, examples",
            module="c.export",
            function="export_c",
            run_command="make && ./example",
            guide="native.md",
        ),
        Host(
            "fem",
            codes="OpenGeoSys, Kratos and other finite elements with MGIS or UMAT",
            contents="MGIS and UMAT libraries, shear tests",
            module="fem.export",
            function="export_fem",
            run_command="make",
            guide="native.md#finite-elements",
            options=(
                ExportOption(
                    "seating",
                    "Pa",
                    "STRESS",
                    f"normal stress before the first step (default {DEFAULT_SEATING / 1e3:g}kPa)",
                    default=DEFAULT_SEATING,
                ),
            ),
        ),
        Host(
            "lammps",
            codes="LAMMPS, also with MPI",
            contents="a pair style, an input script",
            module="lammps.export",
            function="export_lammps",
            run_command="./build.sh && lmp -in in.tower",
            guide="particles.md#lammps",
        ),
    )
}
