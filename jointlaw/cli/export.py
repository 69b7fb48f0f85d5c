"""`jointlaw export`: a law as files for a host code, one of `jointlaw.hosts.HOSTS`."""

import argparse
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..hosts import HOSTS, ExportOption, Host
from ..hosts.c.export import identifier
from ..parameters.aperture import Aperture
from ..support.files import clear_run
from .command import (
    LAW,
    OUT,
    Command,
    Option,
    option,
    quantity,
    read_about,
    read_aperture,
    read_law,
)


def _run(options: argparse.Namespace) -> None:
    law = read_law(options)
    read_about(options)  # prints the warnings of the law
    aperture = read_aperture(options.law)
    host = HOSTS[options.host]
    with TemporaryDirectory() as complete:  # a law that is refused leaves the folder unchanged
        text = _export(host, law, aperture, complete, options)
        clear_run(options.out)
        for file in Path(complete).iterdir():
            shutil.copy(file, options.out)
    print(f"{text}\nrun: cd {options.out} && {host.run_command}")


def _export(
    host: Host,
    law: Any,
    aperture: Aperture | None,
    folder: str,
    options: argparse.Namespace,
) -> str:
    """Write the files of a host into `folder`.

    Returns the text for the user: the report of the host if it has one, else the names of the
    files.
    """
    arguments = {one.keyword: getattr(options, one.keyword) for one in host.options}
    arguments["aperture"] = aperture
    if host.names_tables:
        arguments["name"] = identifier(Path(options.law).stem)
    result = host.load(host.function)(law, folder, **arguments)
    if host.report:
        return str(host.load(host.report)(result, law))
    return f"wrote {', '.join(result)}"


def _example(host: str) -> str:
    return f"jointlaw export {host} jing-replica --out joint-for-{host}"


def _option(one: ExportOption) -> Option:
    """The option of the command for an option of an export function."""
    return option(
        f"--{one.keyword.replace('_', '-')}",
        metavar=one.metavar,
        type=quantity(one.unit, positive=one.positive),
        default=one.default,
        help=one.help,
    )


def _host_command(host: Host) -> Command:
    """The command for one host."""
    purpose = f"write a law for {host.codes}. Files: {host.contents}"
    return Command(
        host.name, purpose, _example(host.name), _run, (*LAW, *map(_option, host.options), *OUT)
    )


COMMAND = Command(
    "export",
    "write a law for a host code into one folder: YADE, LAMMPS, C, finite elements",
    _example("lammps"),
    _run,
    subcommands=tuple(map(_host_command, HOSTS.values())),
)
