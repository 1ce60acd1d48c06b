"""Export of a turbine as an OpenFAST 5 deck, for a simulation of the same case there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.core.files import replacing
from meltemi.core.threads import one_blas_thread
from meltemi.environment.site import Environment
from meltemi.exchange.openfast_writer.aerodyn import aerodyn
from meltemi.exchange.openfast_writer.beamdyn import beamdyn_files
from meltemi.exchange.openfast_writer.deck import DeckNotes, ExportModel, Texts, deck_of, limits
from meltemi.exchange.openfast_writer.elastodyn import elastodyn
from meltemi.exchange.openfast_writer.inflow import inflow
from meltemi.exchange.openfast_writer.main import FRAME_STEP, STEPS, main_file, time_step_of
from meltemi.exchange.openfast_writer.olaf import olaf
from meltemi.exchange.openfast_writer.servo import servo
from meltemi.exchange.report import ImportNote
from meltemi.sea.conditions import Sea, StillWater
from meltemi.simulation.options import ModelOptions
from meltemi.turbine.power_turbine import AnyTurbine, aeroelastic
from meltemi.wind.fields import SteadyWind


@dataclass(frozen=True)
class ExportedDeck:
    """An exported deck.

    Attributes:
      main: the main file (.fst).
      files: all files.
      notes: features that the deck lacks or approximates.
    """

    main: Path
    files: tuple[Path, ...]
    notes: tuple[ImportNote, ...]


@one_blas_thread
def write_openfast(  # noqa: PLR0913 - entries of the decks, each with a default
    turbine: AnyTurbine,
    folder: str | Path,
    *,
    options: ModelOptions | None = None,
    environment: Environment | None = None,
    wind: SteadyWind | str | Path | None = None,
    direction: float = 0.0,
    duration: float = 600.0,
    time_step: float | None = None,
    rotor_speed: float | None = None,
    pitch: float | None = None,
    azimuth: float = 0.0,
    beamdyn: bool = False,
    library: str | Path | None = None,
    settings: str | Path = "DISCON.IN",
    sea: Sea | None = None,
) -> ExportedDeck:
    """Write a turbine as input of OpenFAST 5: main file, ElastoDyn, AeroDyn, InflowWind, ServoDyn, airfoils.

    OLAF too for hybrid and free wakes. Offshore also SeaState with every wave, HydroDyn with potential-flow
    coefficients, and SubDyn or MoorDyn.
    BeamDyn files are written for blades with torsional stiffness. Mode shapes are those of the turbine description, or
    the best polynomials of ElastoDyn for the sections.

    Args:
      turbine: aeroelastic turbine.
      folder: created if needed; files of the same names are replaced.
      options: degrees of freedom and aerodynamic models.
      environment: air density and gravity.
      wind: a steady wind (12 m/s by default), or a TurbSim file (.bts).
      direction: [rad] angle by which the wind of a file is rotated, clockwise from above.
      duration: [s] simulated time.
      time_step: [s]; by default that of the options, or the one required by the highest frequency of ElastoDyn's
        degrees of freedom, at most 0.01 s; with BeamDyn and SubDyn, which are coupled implicitly, 0.01 s.
      rotor_speed: [rad/s] initial; by default rated.
      pitch: [rad] initial; by default the minimum.
      azimuth: [rad] initial, of blade 1, 0 when it points up.
      beamdyn: compute the blades with BeamDyn (CompElast 2) instead of ElastoDyn.
      library: Bladed-style controller library, with its input file ``settings``; without it the torque follows
        OpenFAST's simple law of regions 2 and 2 1/2 at constant pitch.
      settings: see library.
      sea: sea of an offshore turbine; by default still water.

    Raises:
      InputError: a file cannot be written, the kind of wind is not supported, or a sea is given for an onshore turbine.
      UnsupportedError: a blade has ice, BeamDyn is requested for a blade without torsion, the turbine cannot
        be modelled, or OpenFAST cannot represent the support, platform, current or waves.
    """
    turbine, folder = aeroelastic(turbine, "write_openfast"), Path(folder)
    if turbine.icing is not None:
        raise UnsupportedError(f"{turbine.name}: a deck has no ice; take it off with with_ice(turbine, None)")
    if turbine.imbalance is not None:
        raise UnsupportedError(f"{turbine.name}: a deck has blades of one kind; take the imbalance off: imbalance=None")
    if turbine.frame is not None and turbine.platform is not None:
        raise UnsupportedError(
            f"{turbine.name}: a floating frame is not written; take it off for a rigid platform: frame=None"
        )
    if beamdyn and not turbine.blade.structure.twists:
        raise UnsupportedError(f"{turbine.name}: BeamDyn needs blade.structure.torsion_stiffness, or 6 x 6 matrices")
    deck, notes = deck_of(turbine, options or ModelOptions(), environment or Environment()), DeckNotes(turbine.name)
    limits(deck, notes)
    rated = turbine.rated_rotor_speed
    start = (rated if rotor_speed is None else rotor_speed, turbine.control.pitch.minimum if pitch is None else pitch)
    implicit = STEPS[0] if turbine.frame is None else FRAME_STEP
    step = time_step or deck.options.time_step or (implicit if beamdyn or deck.stands else time_step_of(deck))
    if sea is not None and not deck.at_sea:
        raise InputError(f"sea: {turbine.name} stands on land")
    hydro_files = _water(deck, notes, StillWater() if sea is None else sea, duration) if deck.at_sea else {}
    texts = main_file(deck, hydro_files, duration, step, beamdyn, 0.0 if sea is None else sea.level) | hydro_files
    texts |= elastodyn(deck, notes, *start, azimuth, beamdyn=beamdyn)
    if turbine.blade.structure.twists:
        texts |= beamdyn_files(deck, notes)
    texts |= aerodyn(deck, notes) | olaf(deck, notes, step, start[0])
    texts |= inflow(deck, notes, SteadyWind(speed=12.0) if wind is None else wind, direction)
    texts |= servo(deck, notes, start[1], library, settings)
    return ExportedDeck(folder / f"{deck.name}.fst", tuple(_save(folder, texts)), tuple(notes))


def _save(folder: Path, texts: Mapping[str, str]) -> list[Path]:
    files = [folder / name for name in texts]
    try:
        for path in files:
            path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{error.filename or folder}: cannot be written ({error.strerror or error})") from None
    with replacing(*files) as partial:  # an incomplete deck could be mistaken for a valid one
        for path, text in zip(partial, texts.values(), strict=True):
            path.write_text(text, encoding="utf-8")
    return files


def _water(deck: ExportModel, notes: DeckNotes, sea: Sea, duration: float) -> Texts:
    """Files of the sea and of the support structure; the module is imported only for offshore turbines."""
    from meltemi.exchange.openfast_writer import frame as frames
    from meltemi.exchange.openfast_writer import water
    from meltemi.frames.reduction import tower_base
    from meltemi.sea.pile_beam import first_frequency

    texts: Texts = {}
    pile, frame, platform = deck.turbine.support, deck.turbine.frame, deck.turbine.platform
    assert deck.below is not None, "at sea"
    if frame is None or frames.wet_members(frame):
        water.sea_state(texts, deck.title, sea, duration, deck.below)
    first = first_frequency(deck.model.rotor.tower.modes) if deck.stands else 0.0
    if frame is not None:
        if "SeaState.dat" in texts:
            texts["HydroDyn.dat"] = frames.water(deck.title, frame, sea.level, notes.changed)
        base = tower_base(frame, deck.turbine.tower)
        frames.structure(texts, deck.title, frame, base, first, notes.changed)
    if pile is not None:
        texts["HydroDyn.dat"] = water.pile_water(deck.title, pile)
        water.pile_structure(texts, deck.title, pile, deck.turbine.foundation, first)
        if pile.shear_share != 0.5:
            notes.changed("support.shear_share", "that of SubDyn's tubes")
    if platform is not None:
        water.platform_water(texts, deck.title, platform, notes.changed)
        if platform.lines:
            texts["MoorDyn.dat"] = water.mooring(deck.title, platform)
        if any(line.strength is not None for line in platform.lines):
            notes.lost("strength of lines", "MoorDyn's lines do not part")
        if platform.line_model == "static":
            notes.changed("lines in static shapes", f"moving lines of {water.FEWEST_SEGMENTS} segments")
    return texts
