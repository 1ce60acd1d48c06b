"""Options of a command stand in the signature of its function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
import typer
from typer.testing import CliRunner

from meltemi import InputError
from meltemi.app.commands import CommandGroup
from meltemi.app.options import completing
from meltemi.app.signatures import POSITIVE, Range, with_options
from meltemi.app.terminal import OutOption

CALLED: list[dict[str, Any]] = []


@dataclass(frozen=True)
class Shared:
    """Options of several commands."""

    seed: Annotated[int | None, "Seed."] = None


def everything(
    turbine: Annotated[str, "A turbine.", completing(lambda: {"nrel5mw": "5 MW", "iea15mw": "15 MW"})],
    shared: Shared,
    years: Annotated[float, "Lifetime [years].", Range(1, 50)] = 20.0,
    step: Annotated[float | None, "Time step [s].", POSITIVE] = None,
    stall: Annotated[Literal["static", "dynamic"], "Model of stall."] = "static",
    theme: Annotated[Literal["light", "dark"] | None, "Colours."] = None,
    channels: Annotated[tuple[str, ...] | None, "Channels."] = None,
    inputs: Annotated[tuple[str, ...], "Inputs."] = ("pitch", "torque"),
    seen: Annotated[bool, "--view", "-v", "Also a view."] = False,
    old: Annotated[str, typer.Option("--former", help="As Typer takes it.")] = "x",
    out: OutOption = Path("out"),
) -> None:
    """A command with options of all kinds."""
    CALLED.append(locals())


def called(*words: str) -> dict[str, Any]:
    """Arguments with which the function is called."""
    group = CommandGroup("A group.")
    group.command()(everything)
    ran = CliRunner().invoke(group, words)
    if ran.exception is not None:
        raise ran.exception
    return CALLED.pop()


def test_the_function_gets_values(tmp_path: Path) -> None:
    usual = called("nrel5mw", "--out", str(tmp_path / "new"))
    assert usual.pop("out") == tmp_path / "new" and (tmp_path / "new").is_dir()
    assert usual == {
        "turbine": "nrel5mw", "shared": Shared(), "years": 20.0, "step": None, "stall": "static", "theme": None,
        "channels": None, "inputs": ("pitch", "torque"), "seen": False, "old": "x",
    }  # fmt: skip
    words = "--seed 3 --years 50 --step 0.1 --stall dynamic --theme dark --channels a,,b --inputs x --former y -v"
    given = called("nrel5mw", *words.split(), "--out", str(tmp_path))
    assert (given["shared"], given["years"], given["step"], given["seen"]) == (Shared(3), 50.0, 0.1, True)
    assert (given["stall"], given["theme"], given["old"]) == ("dynamic", "dark", "y")
    assert (given["channels"], given["inputs"]) == (("a", "b"), ("x",))
    assert called("nrel5mw", "--channels", ",", "--out", str(tmp_path))["channels"] == ()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--years 0.5", "--years 0.5: expected 1 to 50"),
        ("--years nan", "--years nan: expected 1 to 50"),
        ("--step 0", "--step 0: expected more than 0"),
        ("--stall dinamic", "--stall 'dinamic': did you mean 'dynamic'?"),
        ("--theme blue", "--theme 'blue': expected light or dark"),
    ],
)
def test_choices_and_ranges_are_checked(tmp_path: Path, words: str, said: str) -> None:
    with pytest.raises(InputError) as error:
        called("nrel5mw", *words.split(), "--out", str(tmp_path))
    assert str(error.value) == said


def test_the_command_has_names_help_and_completion() -> None:
    group = typer.Typer()
    group.command()(with_options(everything))
    command = typer.main.get_command(group)
    assert command.help == everything.__doc__
    options: dict[str, Any] = {p.name or "": p for p in command.params}
    assert options["turbine"].required and options["turbine"].param_type_name == "argument"
    assert options["seen"].opts == ["--view", "-v"] and options["seen"].help == "Also a view."
    assert options["as_json"].opts == ["--json"]
    complete: Callable[[str, str], list[str]] = lambda name, text: [  # noqa: E731
        item.value for item in options[name].shell_complete(typer.Context(command), text)
    ]
    assert complete("turbine", "n") == ["nrel5mw"] and complete("stall", "") == ["static", "dynamic"]
