"""Compiled controllers as shared libraries with the Bladed interface.

The control law is the optimised LLVM code of a run, compiled for any processor of the platform; it calls only the
mathematical functions of C. ``discon.c`` handles the swap array, the initial state, the parameters and the log.
"""

from __future__ import annotations

import math
import os
import shlex
import shutil
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import meltemi
from meltemi.bladed_controllers.records import MESSAGE_SIZE, RECORDS
from meltemi.compiler import CompilationError, is_compiled, last_line, object_code
from meltemi.control.controller import UPDATE, Controller, of_vectors
from meltemi.control.signals import Demands, Measurements
from meltemi.core.errors import InputError
from meltemi.core.files import replacing, write_text
from meltemi.environment.grid import NOMINAL_FREQUENCY
from meltemi.exchange.controller_library.starts import POINTS, StartRule, start_rules
from meltemi.turbine.power_turbine import AnyTurbine

COMPILERS = ("cc", "gcc", "clang")
C_FUNCTIONS = frozenset(
    "acos asin atan atan2 cbrt ceil copysign cos cosh erf erfc exp exp2 expm1 fabs floor fma fmax fmin fmod hypot "
    "ldexp lgamma log log10 log1p log2 nearbyint pow rint round sin sincos sinh sqrt tan tanh tgamma trunc memcpy "
    "memset memmove abort NRT_MemInfo_call_dtor".split()
)
"""Functions that the code of a law may call; the last one, for vectors of Python objects, is never called."""
ROWS = {
    "TIME_ROW": "time",
    "YAW_ROW": "yaw",
    "YAW_RATE_ROW": "yaw_rate",
    "WIND_DIRECTION_ROW": "wind_direction",
    "POWER_REFERENCE_ROW": "power_reference",
    "HUB_MOMENT_ROW": "hub_moment_x",
    "YAW_BEARING_ROW": "yaw_bearing_moment_x",
}
DEMAND_ROWS = {
    "TORQUE_ROW": "generator_torque",
    "PITCH_ROW": "pitch_1",
    "BRAKE_ROW": "brake",
    "YAW_RATE_DEMAND_ROW": "yaw_rate",
    "FLAP_ROW": "flap_1_1",
    "STATE_ROW": "operating_state",
    "POWER_STATE_ROW": "power_state",
}
HEADER = """# Parameters of the controller {name} for {turbine}, in SI units (rad, rad/s, N m, W).
# The library reads them at its first call; a line may be left out, or added for any entry of the controller's state.
"""


@dataclass(frozen=True)
class ExportedController:
    """Files of an exported controller.

    Attributes:
      library, parameters: paths of the library, and of the text file beside it.
      inexact: names of entries of the initial state that the library interpolates, with their largest relative
        difference; the run then begins with a small transient of the controller.
      unmeasured: measurements that the interface does not provide, and which keep a constant value.
    """

    library: Path
    parameters: Path
    inexact: dict[str, float]
    unmeasured: tuple[str, ...]


def export_controller(controller: Controller, turbine: AnyTurbine, path: str | Path) -> ExportedController:
    """Export a compiled controller as a shared library with the Bladed interface, without Python and meltemi.

    Args:
      controller: compiled: one of meltemi's, or with an ``update`` decorated by ``numba.njit``.
      turbine: turbine for which the controller was designed.
      path: path of the library (``.so``, ``.dylib``, ``.dll``).

    Returns:
      The paths, and the limitations of the library.

    Raises:
      InputError: the controller is plain Python, a library, or calls what a library cannot; flaps of a blade move
        independently; or there is no C compiler.
    """
    path = Path(path)
    if path.suffix not in (".so", ".dylib", ".dll"):
        raise InputError(f"{path}: expected the name of a shared library, such as libcontroller.so")
    if controller.fresh is not None or controller.close is not None:
        raise InputError(
            f"controller {controller.name!r} is a library, or keeps its state outside; it cannot be exported"
        )
    if not is_compiled(controller.update):
        raise InputError(
            f"controller {controller.name!r} is plain Python, which a library cannot contain: decorate its update by "
            "numba.njit"
        )
    if len(turbine.flaps) > 1:
        raise InputError(
            f"{turbine.name} has {len(turbine.flaps)} flaps on each blade, the interface has one record for all of them"
        )
    first, rules, inexact = start_rules(controller, turbine)
    names = controller.state_names or tuple(f"state_{i}" for i in range(len(first)))
    parameters = path.with_suffix(".in")
    with TemporaryDirectory() as name, replacing(path) as (partial,):
        folder = Path(name)
        (folder / "law.o").write_bytes(_object(controller))
        (folder / "constants.h").write_text(_constants(controller, turbine, first, rules, names), encoding="utf-8")
        source = Path(__file__).with_name("discon.c")
        flags = ["-shared", "-fPIC", "-O2", "-ffp-contract=off", f"-I{folder}", str(source), str(folder / "law.o")]
        _compile([*flags, "-o", str(partial), "-lm"])
    varied = {rule.entry for rule in rules}
    kept = [i for i in np.flatnonzero(first) if i not in varied and not math.isinf(first[i])]
    lines = [f"{names[i]} {float(first[i])!r}\n" for i in kept]
    write_text(parameters, HEADER.format(name=controller.name, turbine=turbine.name) + "".join(lines))
    known = {"pitch_1", *(r.source for r in RECORDS), *ROWS.values(), "yaw_bearing_moment_y", "yaw_bearing_moment_z"}
    absent = [n for n in Measurements.names if n not in known and n not in ("callback", "n_blades")]
    unmeasured = tuple(dict.fromkeys("flap" if name.startswith("flap_") else name for name in absent))
    return ExportedController(path, parameters, {names[i]: float(difference) for i, difference in inexact}, unmeasured)


def _object(controller: Controller) -> bytes:
    """Object code of a control law, named ``meltemi_law``, for any processor of this platform.

    Raises:
      InputError: it cannot be compiled, or calls more than mathematical functions.
    """
    try:
        code, foreign = object_code(of_vectors(controller.update), UPDATE.args, "meltemi_law", C_FUNCTIONS)
    except CompilationError as error:
        raise InputError(f"controller {controller.name!r} cannot be compiled: {last_line(error)}") from None
    if foreign:
        raise InputError(
            f"controller {controller.name!r} needs {', '.join(foreign)}, which a library without Python does not have: "
            "an update may compute with numbers and with the vectors that it is given, but not make arrays, lists or "
            "text, nor print"
        )
    return code


def _compile(arguments: Sequence[str]) -> None:
    """Call the C compiler.

    Raises:
      InputError: there is none, or it fails.
    """
    requested = os.environ.get("CC")
    compiler = [*shlex.split(requested)] if requested else [c for c in COMPILERS if shutil.which(c)][:1]
    if not compiler or shutil.which(compiler[0]) is None:
        raise InputError(
            f"the export of a controller needs a C compiler ({', '.join(COMPILERS)}, or the one that CC names), and "
            f"there is none{f' at {requested}' if requested else ''}: "
            "apt install gcc, xcode-select --install, or conda install "
            "c-compiler"
        )
    process = subprocess.run([*compiler, *arguments], capture_output=True, text=True, check=False)
    if process.returncode:
        raise InputError(f"{compiler[0]} failed: {' / '.join(process.stderr.strip().splitlines()[-3:])}")


def _constants(
    controller: Controller, turbine: AnyTurbine, first: Any, rules: Sequence[StartRule], names: Sequence[str]
) -> str:
    """The header of ``discon.c``: sizes, indices, the initial state with its rules, and the records that are read."""
    constant = Measurements(Measurements.zeros())
    constant.n_blades, constant.grid, constant.grid_voltage, constant.power_limit = turbine.n_blades, 1.0, 1.0, math.inf
    constant.grid_frequency, constant.power_reference = NOMINAL_FREQUENCY, turbine.rated_power
    constant.air_temperature, constant.air_pressure = 288.15, 101325.0
    rows = Measurements.names
    read = [(r.number, rows.index(r.source)) for r in RECORDS if r.way == "to" and r.source in rows]
    numbers = {
        "N_STATE": len(first),
        "N_MEASURED": len(rows),
        "N_DEMANDS": len(Demands.names),
        "N_BLADES": turbine.n_blades,
        "N_FLAPS": len(turbine.flaps),
        "N_RULES": len(rules),
        "N_READ": len(read),
        "TABLE": POINTS,
        "MESSAGE_SIZE": MESSAGE_SIZE // 4,
        "SAMPLE_TIME": float(controller.sample_time or 0.0),
        **{key: rows.index(name) for key, name in ROWS.items()},
        **{key: Demands.names.index(name) for key, name in DEMAND_ROWS.items()},
    }
    texts = {"CONTROLLER": controller.name, "TURBINE": turbine.name, "VERSION": meltemi.__version__}
    lines = [f"#define {key} {value}" for key, value in numbers.items()]
    lines += [f"#define {key} {_text(value)}" for key, value in texts.items()]
    lines += [f"static const double FIRST[N_STATE] = {_list(first)};"]
    lines += [f"static const double CONSTANT[N_MEASURED] = {_list(constant.array)};"]
    lines += [f"static const char *const NAMES[N_STATE] = {{{', '.join(map(_text, names))}}};"]
    lines += [f"static const double TABLE_{r.entry}[TABLE] = {_list(r.table)};" for r in rules if r.table]
    lines += ["typedef struct { int entry, input, kind; double a, b, c; const double *table; } StartRule;"]
    listed = [
        f"{{{r.entry}, {r.quantity}, {r.kind}, {r.a!r}, {r.b!r}, {r.c!r}, {f'TABLE_{r.entry}' if r.table else '0'}}}"
        for r in rules
    ]
    lines += [f"static const StartRule RULES[] = {{{', '.join(listed) or '{0}'}}};"]
    pairs = ", ".join(f"{{{number}, {row}}}" for number, row in read)
    lines += [f"static const struct {{ int record, row; }} READ[] = {{{pairs}}};"]
    return "\n".join(lines) + "\n"


def _list(values: Iterable[float]) -> str:
    return "{" + ", ".join("INFINITY" if x == math.inf else repr(float(x)) for x in values) + "}"


def _text(words: str) -> str:
    """A string of C; what is not plain ASCII becomes a question mark."""
    return '"' + "".join(c if c.isascii() and c.isprintable() and c not in '"\\' else "?" for c in words) + '"'
