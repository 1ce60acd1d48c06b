"""meltemi: flexible wind turbines in turbulent wind, under control, and their loads.

    import meltemi

    turbine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(turbine)
    result = meltemi.simulate(model, meltemi.SteadyWind(speed=12.0), duration=60.0)
    meltemi.plot(result).savefig("run.png")

Names are imported when they are first used, so ``import meltemi`` is quick.
"""

from __future__ import annotations

from importlib import import_module
from types import FunctionType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from meltemi.control.baseline import BaselineController as BaselineController
    from meltemi.control.bladed.controller import BladedController as BladedController
    from meltemi.control.bladed.rosco import edit_discon as edit_discon
    from meltemi.control.bladed.rosco import find_rosco as find_rosco
    from meltemi.control.constant import ConstantController as ConstantController
    from meltemi.control.controller import Controller as Controller
    from meltemi.control.controller import LogEntry as LogEntry
    from meltemi.control.controller import StartPoint as StartPoint
    from meltemi.control.coordinated import CoordinatedController as CoordinatedController
    from meltemi.control.coordinated import Coordination as Coordination
    from meltemi.control.load_control import FeedForward as FeedForward
    from meltemi.control.load_control import HarmonicLoop as HarmonicLoop
    from meltemi.control.load_control import LoadControl as LoadControl
    from meltemi.control.load_control import LoadController as LoadController
    from meltemi.control.load_control import LoadSensor as LoadSensor
    from meltemi.control.load_control import Preview as Preview
    from meltemi.control.load_control import SpeedNotch as SpeedNotch
    from meltemi.control.power_control.controller import PowerController as PowerController
    from meltemi.control.power_control.settings import Droop as Droop
    from meltemi.control.power_control.settings import PowerControl as PowerControl
    from meltemi.control.supervisor.settings import Supervision as Supervision
    from meltemi.control.supervisor.supervised import SupervisedController as SupervisedController
    from meltemi.control.supervisor.threshold import YawProtection as YawProtection
    from meltemi.control.supervisor.threshold import yaw_threshold as yaw_threshold
    from meltemi.control.yaw import YawControl as YawControl
    from meltemi.control.yaw import YawController as YawController
    from meltemi.core.errors import InputError as InputError
    from meltemi.core.errors import MeltemiError as MeltemiError
    from meltemi.core.errors import RunError as RunError
    from meltemi.core.errors import Status as Status
    from meltemi.core.errors import UnsupportedError as UnsupportedError
    from meltemi.core.series import TimeSeries as TimeSeries
    from meltemi.environment.air import Air as Air
    from meltemi.environment.air import air_density as air_density
    from meltemi.environment.climate import Climate as Climate
    from meltemi.environment.climate import list_climates as list_climates
    from meltemi.environment.climate import load_climate as load_climate
    from meltemi.environment.grid import PowerGrid as PowerGrid
    from meltemi.environment.rain import Rain as Rain
    from meltemi.environment.site import Environment as Environment
    from meltemi.loadcases.batch import BatchCase as BatchCase
    from meltemi.loadcases.batch import Outcome as Outcome
    from meltemi.loadcases.batch import simulate_batch as simulate_batch
    from meltemi.loadcases.case import LoadCase as LoadCase
    from meltemi.loadcases.case import read_case as read_case
    from meltemi.loadcases.openfast import deck_case as deck_case
    from meltemi.postprocess.bands import Ceiling as Ceiling
    from meltemi.postprocess.bands import ceiling as ceiling
    from meltemi.postprocess.bands import harmonic_bands as harmonic_bands
    from meltemi.postprocess.bands import remove_bands as remove_bands
    from meltemi.postprocess.bins import bin_statistics as bin_statistics
    from meltemi.postprocess.bins import period_statistics as period_statistics
    from meltemi.postprocess.difference import ChannelDifference as ChannelDifference
    from meltemi.postprocess.difference import Differences as Differences
    from meltemi.postprocess.difference import compare_results as compare_results
    from meltemi.postprocess.ensemble import EnsembleEntry as EnsembleEntry
    from meltemi.postprocess.ensemble import EnsembleTable as EnsembleTable
    from meltemi.postprocess.ensemble import Estimate as Estimate
    from meltemi.postprocess.ensemble import ensemble_load as ensemble_load
    from meltemi.postprocess.ensemble import ensemble_table as ensemble_table
    from meltemi.postprocess.ensemble import lifetime_del as lifetime_del
    from meltemi.postprocess.ensemble import mean_interval as mean_interval
    from meltemi.postprocess.ensemble import rayleigh_weights as rayleigh_weights
    from meltemi.postprocess.ensemble import travel as travel
    from meltemi.postprocess.ensemble import weibull_weights as weibull_weights
    from meltemi.postprocess.fatigue import damage_equivalent_load as damage_equivalent_load
    from meltemi.postprocess.fatigue import equivalent_loads as equivalent_loads
    from meltemi.postprocess.fatigue import rainflow_cycles as rainflow_cycles
    from meltemi.postprocess.files import read_netcdf as read_netcdf
    from meltemi.postprocess.files import read_result as read_result
    from meltemi.postprocess.files import write_netcdf as write_netcdf
    from meltemi.postprocess.files import write_result as write_result
    from meltemi.postprocess.spectra import Peak as Peak
    from meltemi.postprocess.spectra import PowerSpectrum as PowerSpectrum
    from meltemi.postprocess.spectra import average_spectra as average_spectra
    from meltemi.postprocess.spectra import decibels as decibels
    from meltemi.postprocess.spectra import peak as peak
    from meltemi.postprocess.spectra import power_spectrum as power_spectrum
    from meltemi.postprocess.spectra import rotor_frequency as rotor_frequency
    from meltemi.postprocess.statistics import revolution_means as revolution_means
    from meltemi.report.comparison_plots import plot_changes as plot_changes
    from meltemi.report.difference_plots import plot_differences as plot_differences
    from meltemi.report.ensemble_tables import ensemble_rows as ensemble_rows
    from meltemi.report.plots import plot as plot
    from meltemi.report.plots import plot_campbell as plot_campbell
    from meltemi.report.plots import plot_performance as plot_performance
    from meltemi.report.plots import plot_power_curve as plot_power_curve
    from meltemi.report.power_plots import plot_speed_power as plot_speed_power
    from meltemi.report.spectra_plots import plot_spectra as plot_spectra
    from meltemi.report.state_diagram import plot_states as plot_states
    from meltemi.report.tables import rich_table as rich_table
    from meltemi.report.tables import write_csv as write_csv
    from meltemi.report.tuning_plots import plot_tuning as plot_tuning
    from meltemi.report.turbine_plots import plot_turbine as plot_turbine
    from meltemi.report.wind_plots import plot_wind as plot_wind
    from meltemi.simulation.campbell import Campbell as Campbell
    from meltemi.simulation.campbell import campbell as campbell
    from meltemi.simulation.events import Brake as Brake
    from meltemi.simulation.events import BrakeFault as BrakeFault
    from meltemi.simulation.events import FlapStuck as FlapStuck
    from meltemi.simulation.events import GeneratorFault as GeneratorFault
    from meltemi.simulation.events import GridLoss as GridLoss
    from meltemi.simulation.events import PitchRunaway as PitchRunaway
    from meltemi.simulation.events import PitchStuck as PitchStuck
    from meltemi.simulation.events import PowerLimit as PowerLimit
    from meltemi.simulation.events import Request as Request
    from meltemi.simulation.events import SensorDrift as SensorDrift
    from meltemi.simulation.events import SensorLoss as SensorLoss
    from meltemi.simulation.events import SensorOffset as SensorOffset
    from meltemi.simulation.events import VoltageDip as VoltageDip
    from meltemi.simulation.events import YawStuck as YawStuck
    from meltemi.simulation.linear import LinearModel as LinearModel
    from meltemi.simulation.linear import linearise as linearise
    from meltemi.simulation.model import Model as Model
    from meltemi.simulation.model import Stations as Stations
    from meltemi.simulation.modes import natural_modes as natural_modes
    from meltemi.simulation.options import BEDDOES as BEDDOES
    from meltemi.simulation.options import ModelOptions as ModelOptions
    from meltemi.simulation.options import StallConstants as StallConstants
    from meltemi.simulation.parked import parked_point as parked_point
    from meltemi.simulation.performance import performance_of as performance_of
    from meltemi.simulation.performance import rotor_performance as rotor_performance
    from meltemi.simulation.result import Finding as Finding
    from meltemi.simulation.result import Result as Result
    from meltemi.simulation.rotors import build as build
    from meltemi.simulation.rotors import operating_point as operating_point
    from meltemi.simulation.simulate import Simulation as Simulation
    from meltemi.simulation.simulate import simulate as simulate
    from meltemi.simulation.start import Start as Start
    from meltemi.simulation.trim import OperatingPoint as OperatingPoint
    from meltemi.studies.baseline_tuning import BaselineTuning as BaselineTuning
    from meltemi.studies.baseline_tuning import tune_baseline as tune_baseline
    from meltemi.studies.compare import Comparison as Comparison
    from meltemi.studies.compare import compare as compare
    from meltemi.studies.comparison_report import write_comparison as write_comparison
    from meltemi.studies.icing import IcingEffects as IcingEffects
    from meltemi.studies.icing import icing_effects as icing_effects
    from meltemi.studies.inspection import inspect_turbine as inspect_turbine
    from meltemi.studies.openfast_writer import write_openfast as write_openfast
    from meltemi.studies.power_twin import power_turbine_of as power_turbine_of
    from meltemi.studies.preview import preview_of as preview_of
    from meltemi.studies.preview import steady_pitch as steady_pitch
    from meltemi.studies.schemes import Design as Design
    from meltemi.studies.schemes import design_controllers as design_controllers
    from meltemi.studies.sensitivity import Sensitivity as Sensitivity
    from meltemi.studies.sensitivity import differences as differences
    from meltemi.studies.sensitivity import sensitivity as sensitivity
    from meltemi.studies.tuning import Tuning as Tuning
    from meltemi.studies.tuning import tune_ipc as tune_ipc
    from meltemi.studies.tuning import tune_loops as tune_loops
    from meltemi.turbine.definition import Flap as Flap
    from meltemi.turbine.definition import FlapIncrements as FlapIncrements
    from meltemi.turbine.definition import Turbine as Turbine
    from meltemi.turbine.electrical import ElectricalSystem as ElectricalSystem
    from meltemi.turbine.electrical import size_electrical as size_electrical
    from meltemi.turbine.flaps import naca64618_flap as naca64618_flap
    from meltemi.turbine.flaps import with_flaps as with_flaps
    from meltemi.turbine.gearbox import Gearbox as Gearbox
    from meltemi.turbine.gearbox import ParallelStage as ParallelStage
    from meltemi.turbine.gearbox import PlanetaryStage as PlanetaryStage
    from meltemi.turbine.gearbox import size_gearbox as size_gearbox
    from meltemi.turbine.icing import Icing as Icing
    from meltemi.turbine.icing import with_ice as with_ice
    from meltemi.turbine.library import LibraryEntry as LibraryEntry
    from meltemi.turbine.library import library_entries as library_entries
    from meltemi.turbine.library import list_turbines as list_turbines
    from meltemi.turbine.library import load_turbine as load_turbine
    from meltemi.turbine.library import write_turbine as write_turbine
    from meltemi.turbine.openfast import Deck as Deck
    from meltemi.turbine.openfast import read_deck as read_deck
    from meltemi.turbine.openfast import read_openfast as read_openfast
    from meltemi.turbine.performance import Performance as Performance
    from meltemi.turbine.plausibility import plausibility as plausibility
    from meltemi.turbine.power_turbine import CalibratedCoefficient as CalibratedCoefficient
    from meltemi.turbine.power_turbine import HeierCoefficient as HeierCoefficient
    from meltemi.turbine.power_turbine import PowerTurbine as PowerTurbine
    from meltemi.turbine.power_turbine import Shaft as Shaft
    from meltemi.turbine.power_turbine import TableCoefficient as TableCoefficient
    from meltemi.turbine.report import Imported as Imported
    from meltemi.turbine.report import Note as Note
    from meltemi.turbine.report import report_text as report_text
    from meltemi.turbine.scaling import Masses as Masses
    from meltemi.turbine.scaling import scale_turbine as scale_turbine
    from meltemi.turbine.scaling import typical_masses as typical_masses
    from meltemi.turbine.windio import import_windio as import_windio
    from meltemi.turbine.windio import read_windio as read_windio
    from meltemi.wind.fields import SteadyWind as SteadyWind
    from meltemi.wind.fields import WindBox as WindBox
    from meltemi.wind.fields import WindSeries as WindSeries
    from meltemi.wind.fields import at_speed as at_speed
    from meltemi.wind.files import Hawc2Grid as Hawc2Grid
    from meltemi.wind.files import read_bladed as read_bladed
    from meltemi.wind.files import read_bts as read_bts
    from meltemi.wind.files import read_hawc2 as read_hawc2
    from meltemi.wind.files import read_hub_csv as read_hub_csv
    from meltemi.wind.files import read_wind_netcdf as read_wind_netcdf
    from meltemi.wind.files import read_wnd as read_wnd
    from meltemi.wind.files import write_bladed as write_bladed
    from meltemi.wind.files import write_bts as write_bts
    from meltemi.wind.files import write_hawc2 as write_hawc2
    from meltemi.wind.files import write_hub_csv as write_hub_csv
    from meltemi.wind.files import write_wind_netcdf as write_wind_netcdf
    from meltemi.wind.files import write_wnd as write_wnd
    from meltemi.wind.formats import read_wind as read_wind
    from meltemi.wind.formats import write_wind as write_wind
    from meltemi.wind.iec.classes import WindClass as WindClass
    from meltemi.wind.iec.classes import extreme_speed as extreme_speed
    from meltemi.wind.iec.classes import sigma_etm as sigma_etm
    from meltemi.wind.iec.classes import sigma_ntm as sigma_ntm
    from meltemi.wind.iec.classes import wind_class as wind_class
    from meltemi.wind.iec.gusts import ecd as ecd
    from meltemi.wind.iec.gusts import ecg as ecg
    from meltemi.wind.iec.gusts import edc as edc
    from meltemi.wind.iec.gusts import eog as eog
    from meltemi.wind.iec.gusts import ews_horizontal as ews_horizontal
    from meltemi.wind.iec.gusts import ews_vertical as ews_vertical
    from meltemi.wind.iec.models import iec_wind as iec_wind
    from meltemi.wind.iec.winds import etm as etm
    from meltemi.wind.iec.winds import ewm_steady as ewm_steady
    from meltemi.wind.iec.winds import ewm_turbulent as ewm_turbulent
    from meltemi.wind.iec.winds import ntm as ntm
    from meltemi.wind.iec.winds import nwp as nwp
    from meltemi.wind.statistics import field_statistics as field_statistics
    from meltemi.wind.statistics import series_statistics as series_statistics
    from meltemi.wind.statistics import wind_coherence as wind_coherence
    from meltemi.wind.statistics import wind_spectrum as wind_spectrum
    from meltemi.wind.superposition import with_gust as with_gust
    from meltemi.wind.turbulence.field import generate_field as generate_field
    from meltemi.wind.turbulence.grid import Grid as Grid
    from meltemi.wind.turbulence.grid import grid_for as grid_for
    from meltemi.wind.turbulent import HubSeries as HubSeries
    from meltemi.wind.turbulent import TurbulentWind as TurbulentWind

__version__ = "0.1.0"

_HOME = {
    "control.baseline": "BaselineController",
    "control.bladed.controller": "BladedController",
    "control.bladed.rosco": "edit_discon find_rosco",
    "control.constant": "ConstantController",
    "control.controller": "Controller LogEntry StartPoint",
    "control.coordinated": "Coordination CoordinatedController",
    "control.load_control": "FeedForward HarmonicLoop LoadControl LoadSensor Preview SpeedNotch LoadController",
    "control.power_control.controller": "PowerController",
    "control.power_control.settings": "Droop PowerControl",
    "control.supervisor.settings": "Supervision",
    "control.supervisor.supervised": "SupervisedController",
    "control.supervisor.threshold": "YawProtection yaw_threshold",
    "control.yaw": "YawControl YawController",
    "core.errors": "InputError MeltemiError RunError Status UnsupportedError",
    "core.series": "TimeSeries",
    "environment.air": "Air air_density",
    "environment.climate": "Climate list_climates load_climate",
    "environment.grid": "PowerGrid",
    "environment.rain": "Rain",
    "environment.site": "Environment",
    "loadcases.batch": "BatchCase Outcome simulate_batch",
    "loadcases.case": "LoadCase read_case",
    "loadcases.openfast": "deck_case",
    "postprocess.bands": "Ceiling ceiling harmonic_bands remove_bands",
    "postprocess.bins": "bin_statistics period_statistics",
    "postprocess.difference": "ChannelDifference Differences compare_results",
    "postprocess.ensemble": (
        "EnsembleEntry EnsembleTable Estimate ensemble_load ensemble_table lifetime_del mean_interval "
        "rayleigh_weights travel weibull_weights"
    ),
    "postprocess.fatigue": "damage_equivalent_load equivalent_loads rainflow_cycles",
    "postprocess.files": "read_netcdf read_result write_netcdf write_result",
    "postprocess.spectra": ("Peak PowerSpectrum average_spectra decibels peak power_spectrum rotor_frequency"),
    "postprocess.statistics": "revolution_means",
    "report.comparison_plots": "plot_changes",
    "report.difference_plots": "plot_differences",
    "report.ensemble_tables": "ensemble_rows",
    "report.plots": "plot plot_campbell plot_performance plot_power_curve",
    "report.power_plots": "plot_speed_power",
    "report.spectra_plots": "plot_spectra",
    "report.state_diagram": "plot_states",
    "report.tables": "rich_table write_csv",
    "report.tuning_plots": "plot_tuning",
    "report.turbine_plots": "plot_turbine",
    "report.wind_plots": "plot_wind",
    "simulation.campbell": "Campbell campbell",
    "simulation.rotors": "build operating_point",
    "simulation.events": (
        "Brake BrakeFault FlapStuck GeneratorFault GridLoss PitchRunaway PitchStuck PowerLimit Request SensorDrift "
        "SensorLoss SensorOffset VoltageDip YawStuck"
    ),
    "simulation.linear": "LinearModel linearise",
    "simulation.model": "Model Stations",
    "simulation.modes": "natural_modes",
    "simulation.options": "BEDDOES ModelOptions StallConstants",
    "simulation.parked": "parked_point",
    "simulation.performance": "performance_of rotor_performance",
    "simulation.result": "Finding Result",
    "simulation.simulate": "Simulation simulate",
    "simulation.start": "Start",
    "simulation.trim": "OperatingPoint",
    "studies.baseline_tuning": "BaselineTuning tune_baseline",
    "studies.compare": "Comparison compare",
    "studies.comparison_report": "write_comparison",
    "studies.icing": "IcingEffects icing_effects",
    "studies.inspection": "inspect_turbine",
    "studies.openfast_writer": "write_openfast",
    "studies.power_twin": "power_turbine_of",
    "studies.preview": "preview_of steady_pitch",
    "studies.schemes": "Design design_controllers",
    "studies.sensitivity": "Sensitivity differences sensitivity",
    "studies.tuning": "Tuning tune_ipc tune_loops",
    "turbine.definition": "Flap FlapIncrements Turbine",
    "turbine.electrical": "ElectricalSystem size_electrical",
    "turbine.flaps": "naca64618_flap with_flaps",
    "turbine.gearbox": "Gearbox ParallelStage PlanetaryStage size_gearbox",
    "turbine.icing": "Icing with_ice",
    "turbine.library": "LibraryEntry library_entries list_turbines load_turbine write_turbine",
    "turbine.openfast": "Deck read_deck read_openfast",
    "turbine.performance": "Performance",
    "turbine.plausibility": "plausibility",
    "turbine.power_turbine": "CalibratedCoefficient HeierCoefficient PowerTurbine Shaft TableCoefficient",
    "turbine.report": "Imported Note report_text",
    "turbine.scaling": "Masses scale_turbine typical_masses",
    "turbine.windio": "import_windio read_windio",
    "wind.fields": "SteadyWind WindBox WindSeries at_speed",
    "wind.files": (
        "Hawc2Grid read_bladed read_bts read_hawc2 read_hub_csv read_wind_netcdf read_wnd "
        "write_bladed write_bts write_hawc2 write_hub_csv write_wind_netcdf write_wnd"
    ),
    "wind.formats": "read_wind write_wind",
    "wind.turbulence.grid": "Grid grid_for",
    "wind.statistics": "field_statistics series_statistics wind_coherence wind_spectrum",
    "wind.turbulence.field": "generate_field",
    "wind.iec.models": "iec_wind",
    "wind.iec.classes": "WindClass extreme_speed sigma_etm sigma_ntm wind_class",
    "wind.iec.gusts": "ecd ecg edc eog ews_horizontal ews_vertical",
    "wind.iec.winds": "etm ewm_steady ewm_turbulent ntm nwp",
    "wind.superposition": "with_gust",
    "wind.turbulent": "HubSeries TurbulentWind",
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names.split()}
__all__ = [*sorted(_MODULE_OF), "__version__"]


def __getattr__(name: str) -> Any:
    if name in _MODULE_OF:
        from meltemi.core.calls import explained

        module = import_module(f"meltemi.{_MODULE_OF[name]}")
        value = getattr(module, name)
        if isinstance(value, FunctionType) and not hasattr(value, "__wrapped__"):
            value = explained(value)
            setattr(module, name, value)  # under its own name, too: what is pickled is found there
        globals()[name] = value
        return value
    from meltemi.core.errors import did_you_mean

    raise AttributeError(f"module 'meltemi' has no attribute {name!r}: {did_you_mean(name, _MODULE_OF)}")


def __dir__() -> list[str]:
    return __all__
