"""jointlaw.h builds with all compilers, rejects damaged files and steps; its examples run."""

import ctypes
import os
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from c_host import HERE, SOURCE, STRICT, build, library
from extremes import laws as extreme_laws
from programs import find_program, run_program

import jointlaw as jl
from jointlaw.cli.main import main
from jointlaw.hosts.c.export import _checksum, header_text, table_text
from jointlaw.native.build import BUILT
from jointlaw.native.layout import TABLE_FORMAT, jointlaw_h

FUZZ = HERE / "fuzz.c"
DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "native.md").read_text()
HOSTS = DOCS.parent / "jointlaw" / "hosts"
SANE = ["-g1", "-O1", "-fno-sanitize-recover=all"]
# JOINTLAW_LONG=1: 1e6 steps and 10 000 files, as docs/native.md tells; twenty minutes on one core.
# Without it every kind of step, size and damage comes as well, on the first twelve of these laws.
LAWS, STEPS, FILES = (200, 5000, 10_000) if "JOINTLAW_LONG" in os.environ else (12, 3000, 500)
COPIED = {
    "native.md": re.search(r"^```c\n(.*?)^```", PAGE, re.M | re.S)[1],
    "jointlaw.h": "\n".join(re.findall(r"^ \*     (.*)", jointlaw_h().partition("*/")[0], re.M)),
}
BARE = ["-DJOINTLAW_SCALAR", "-DJOINTLAW_NO_DISSIPATION"]
NO_NAME = "is no identifier of C; take letters"
DEVICE = """
#define __CUDACC_RTC__
#define __device__ __attribute__((device))
#define __global__ __attribute__((global))
#define __forceinline__ inline __attribute__((always_inline))
typedef unsigned long size_t;
extern "C" {
__device__ double sqrt(double), fabs(double), expm1(double), log1p(double), pow(double, double);
__device__ double exp(double), log(double);
__device__ double hypot(double, double), fmin(double, double), fmax(double, double);
__device__ double sin(double), cos(double), remainder(double, double);
}
struct place { int x; };
extern __device__ const place blockIdx, blockDim, threadIdx;
"""


@pytest.fixture(scope="module")
def law():
    return jl.presets.load("westerly-smooth")


@pytest.fixture(scope="module")
def lib(tmp_path_factory):
    return library(tmp_path_factory.mktemp("c"), "-O0", "-DJOINTLAW_SCALAR")


@pytest.mark.parametrize(
    ("cc", "flags"),
    [("gcc", ["-std=c99", "-O1", *BARE]), ("g++", ["-std=c++17", "-O0"]),
     ("clang", ["-std=c99", "-O0"]), ("clang++", ["-std=c++11", "-O0", *BARE])],
)  # fmt: skip
def test_builds_without_a_warning(tmp_path, law, cc, flags):
    """As a program; at -O3 with vectors the libraries of test_c_kernel.py do so."""
    text = SOURCE + '#include "rock.h"\nint main(void) { return jlaw_dim(&rock) - 3; }\n'
    (tmp_path / "rock.h").write_text(header_text(law, "rock"))
    run_program(build(tmp_path, text, *STRICT, *flags, f"-I{tmp_path}", cc=cc))


def test_compiles_as_cuda(tmp_path, law):
    """By clang, without a CUDA toolkit: the kernel of the page, with built-in functions."""
    (tmp_path / "rock.h").write_text(header_text(law, "rock"))
    kernel = PAGE.partition('RawModule(code=r"""\n')[2].partition('\n"""')[0]
    assert "jlaw_step(" in kernel
    flags = [
        "-x", "cuda", "--cuda-device-only", "--cuda-gpu-arch=sm_80", "-nocudalib", "-nocudainc",
        "-O1", "-S", f"-I{tmp_path}",
    ]  # fmt: skip
    assembly = build(tmp_path, DEVICE + kernel, *flags, cc="clang")
    assert ".entry advance" in assembly.read_text()


@pytest.mark.parametrize("cc", ["gcc", "clang"])
def test_fast_math_is_refused(tmp_path, cc):
    with pytest.raises(AssertionError, match="use -fno-math-errno -fno-trapping-math"):
        build(tmp_path, SOURCE, "-ffast-math", "-c", cc=cc)


# --------------------------------------------------------------- hostile input


@pytest.fixture(scope="module")
def fuzz(tmp_path_factory):
    flags = [*SANE, "-fsanitize=address,undefined,float-cast-overflow", "-lpthread"]
    return build(tmp_path_factory.mktemp("fuzz"), FUZZ, *flags)


def extreme_law(rng):
    """A random valid law and the size of steps; invalid parameters are skipped."""
    while True:
        changes, size = extreme_laws.random_changes(rng)
        try:
            return extreme_laws.build(**changes), size
        except ValueError:
            continue


@pytest.mark.parametrize("seed", range(LAWS))
def test_steps_of_all_kinds_and_sizes(fuzz, tmp_path, seed):
    """Laws of the suite of extremes."""
    extreme, size = extreme_law(np.random.default_rng(20_000 + seed))
    (tmp_path / "x.jlaw").write_text(table_text(extreme))
    text = run_program(fuzz, "steps", tmp_path / "x.jlaw", size, STEPS, seed)
    assert text.startswith(f"{STEPS} steps")


def test_damaged_and_hostile_files(fuzz, tmp_path, law):
    (tmp_path / "x.jlaw").write_text(table_text(law))
    text = run_program(fuzz, "files", tmp_path / "x.jlaw", tmp_path / "y.jlaw", FILES, 1)
    assert text.startswith(f"{FILES} files")


def test_two_threads_on_one_law(tmp_path, law):
    program = build(tmp_path, FUZZ, *SANE, "-DJOINTLAW_SCALAR", "-fsanitize=thread", "-lpthread")
    (tmp_path / "x.jlaw").write_text(table_text(law))
    assert "the same states" in run_program(program, "threads", tmp_path / "x.jlaw")


def resigned(text):
    """The text with a sum that fits."""
    body = text[: text.rindex("\nsum ") + 1]
    return f"{body}sum {_checksum(body.encode()):016x}\n"


BAD = {
    "empty": (lambda text: "", "it is not a table file of jointlaw"),
    "version": (
        lambda text: text.replace(f"tables {TABLE_FORMAT}", "tables 2", 1),
        "another format than this jointlaw.h; export law and header again",
    ),
    "cut": (lambda text: text[: len(text) // 2], "it is truncated: copy the complete file again"),
    "one digit": (
        lambda text: text.replace("0x1", "0x2", 1),
        "it is damaged: its checksum is wrong",
    ),
    "unknown keyword": (
        lambda text: resigned(text.replace("\ncurve_exponent ", "\nfall ", 1)),
        "a keyword is missing, unknown or out of order",
    ),
    "huge": (
        lambda text: resigned(text.replace("\ncells 3", "\ncells 999999", 1)),
        "its sizes are inconsistent",
    ),
    "short table": (
        lambda text: resigned(text.replace("\nenergy\n", "\n", 1)),
        "a table is missing, too short or too long",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_told(lib, tmp_path, law, name):
    change, words = BAD[name]
    (tmp_path / "bad.jlaw").write_text(change(table_text(law)))
    message = ctypes.create_string_buffer(300)
    assert not lib.jlaw_read(str(tmp_path / "bad.jlaw").encode(), message, 300)
    assert message.value.decode().startswith(f"{tmp_path}/bad.jlaw: ")
    assert words in message.value.decode()


# ------------------------------------------------------------ what is exported


def test_the_line_of_the_page_compiles_in_the_memory_that_it_tells(tmp_path):
    """0.2 GB: more kinds of a step in one function would show."""
    (tmp_path / "first.c").write_text(COPIED["native.md"])
    line = re.search(r"^    cc (.*first\.c.*)", PAGE, re.M)[1]
    run_program("sh", "-c", f"ulimit -d 230000; gcc -I{BUILT} {line}", cwd=tmp_path)


def test_examples_build_as_written_and_run(tmp_path, law, capsys, monkeypatch):
    """The lines of the folder's README, and what docs/native.md shows: the same bits at -O0."""
    for cc in ("cc", "c++", "gfortran", "cmake"):
        find_program(cc)
    monkeypatch.chdir(tmp_path)
    command = ["export", "c", "westerly-smooth", "--out", "out", "--resolution", "balanced"]
    assert main(command) == 0
    assert "make && ./example" in capsys.readouterr().out
    folder = tmp_path / "out"
    text = (folder / "README.md").read_text()
    lines = [line.strip() for line in text.splitlines() if line.startswith("    ")]
    assert len(lines) == 8
    outputs = {}
    asks = re.search(r'`python -c "(.*)"` prints the folder', PAGE)[1]
    assert run_program(sys.executable, "-c", asks).strip() == str(BUILT)
    whole = (folder / "CMakeLists.txt").read_text().splitlines()
    assert set(re.search(r"```cmake\n(.*?)```", PAGE, re.S)[1].splitlines()) <= set(whole)
    (folder / "first.c").write_text(COPIED["native.md"])
    lines += [*re.findall(r"^    ((?:cc|c\+\+|gfortran) .*)", PAGE, re.M), "./first"]
    for line in [*lines, "cmake -B build && cmake --build build", "build/example"]:
        outputs[line] = run_program("sh", "-c", line.replace("-O3", "-O0"), cwd=folder)
    assert "`cmake -B build && cmake --build build`" in text
    assert outputs["build/example"] == outputs["./example"]
    for line in ("./example", "./spheres"):
        documented = PAGE.partition(f"$ {line}\n")[2].partition("```")[0].split("...\n")[0]
        assert documented.strip()
        assert outputs[line].startswith(documented)
    joint = replace(law, resolution="balanced").joint()
    for k in range(20):
        F, _ = joint.update([5e-8 * (k < 10), 5e-8 * (k >= 10), 0.0])
    last = [float(cell) for cell in outputs["./fortran"].splitlines()[-1].split(",")]
    assert last[2:] == pytest.approx(1e-6 * F[:2], abs=1e-4)


@pytest.mark.parametrize("name", COPIED)
def test_texts_that_a_user_copies(tmp_path, name):
    """Under AddressSanitizer, for a law with many more state variables than the law in the text."""
    more = 'resolution = "fine"\nmating_length = 1e-5\n'
    text = COPIED[name]
    law = jl.JointLaw.from_text(more + jl.presets.load("westerly-smooth").to_toml())
    (tmp_path / re.search(r'jlaw_read\("(.*?)"', text)[1]).write_text(table_text(law))
    if "int main" not in text:
        head, body = re.match(r"((?:#[^\n]*\n)+)(.*)", text, re.S).groups()
        show = 'printf("%.1f %.1f %.1f Pa\\n", F[0], F[1], F[2]); return 0;'
        text = f"{head}int main(void)\n{{\n{body}\n{show}\n}}\n"
    program = build(tmp_path, text, "-std=c99", *SANE, "-fsanitize=address", "-Werror")
    env = os.environ | {"ASAN_OPTIONS": "detect_leaks=0"}  # they end with the program
    text = run_program(program, cwd=tmp_path, env=env)
    F, _ = law.joint().update([1e-7, 5e-8, 0.0])
    assert [float(word) for word in text.split()[:3]] == pytest.approx(F, abs=0.051)


def test_no_other_page_shows_a_text_in_c():
    pages = [DOCS.parent / "README.md", *DOCS.rglob("*.md"), *HOSTS.rglob("*.md")]
    assert [page.name for page in pages if "```c\n" in page.read_text()] == ["native.md"]


@pytest.mark.parametrize("plane", ["plane = 0.0", "closure_only = true"])
def test_examples_of_fewer_components(tmp_path, law, plane):
    jl.export_c(jl.JointLaw.from_text(f"{plane}\n{law.to_toml()}"), tmp_path, "flat")
    flags = [*STRICT, "-O0", "-DJOINTLAW_SCALAR"]
    law_o = build(tmp_path, SOURCE, *flags, "-std=c99", "-c", name="jointlaw.o")
    flags.append(str(law_o))
    example = build(tmp_path, tmp_path / "example.c", *flags, "-std=c99", name="e")
    lines = run_program(example, tmp_path / "flat.jlaw").splitlines()
    assert len(lines) == (2 if "only" in plane else 41)
    spheres = build(tmp_path, tmp_path / "example.cpp", *flags, "-std=c++11", cc="c++", name="s")
    assert "contacts formed" in run_program(spheres)


BAD_NAMES = ("3mm", "a-b", "", "x" * 60, "double", "class", "jlaw_read")


@pytest.mark.parametrize(
    ("export", "options", "told"),
    [
        *((jl.export_c, {"name": name}, NO_NAME) for name in BAD_NAMES),
        (jl.export_fem, {"name": "a b"}, NO_NAME),
        (jl.export_lammps, {"name": "../joint"}, NO_NAME),
        (jl.export_fem, {"seating": np.nan}, "seating"),
    ],
)
def test_an_export_refuses_before_it_writes(tmp_path, law, export, options, told):
    with pytest.raises(ValueError, match=told):
        export(law, tmp_path / "new", **options)
    assert not (tmp_path / "new").exists()
