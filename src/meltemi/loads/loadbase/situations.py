"""Content of a case file for each operating situation of a load case table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from meltemi.controllers.specification import keyed
from meltemi.core.yamlfile import merged
from meltemi.iec.models import MODELS
from meltemi.loads.loadbase.campaign import Campaign, production_controller, start_controller
from meltemi.loads.loadbase.metocean import Waves, wind_driven
from meltemi.loads.loadbase.table import Fault, LoadCaseRow
from meltemi.sea.conditions import breaking_height

OPERATING = ("production", "start", "normal stop", "emergency stop")
FULL = 360.0
SHORTEST = 0.92
"""Period of an embedded wave over that of the spectrum's peak: the largest waves are 1.3 times as long as the mean
one, whose period is at least 0.71 of it. It decides at which height the wave would break."""


@dataclass(frozen=True)
class Variant:
    """Combination of the conditions that a row varies; None: not varied.

    Attributes:
      model: wind model of IEC 61400-1.
      speed: [m/s] mean wind speed at hub height.
      yaw: [deg] yaw error.
      sense: sense of a direction change or shear, +1 or -1.
      azimuth: [deg] azimuth of a locked rotor, or by which a gust or event is later in a revolution.
      instant: [s] time of the event after the beginning of the gust; at a start, time of the gust.
      fault: name of the fault.
      seed: number of the seed, from 1.
      waves: sea.
    """

    model: str
    speed: float
    yaw: float | None = None
    sense: int | None = None
    azimuth: float | None = None
    instant: float | None = None
    fault: str | None = None
    seed: int | None = None
    waves: Waves | None = None


@dataclass(frozen=True)
class Setting:
    """Conditions from which the content of a case follows.

    Attributes:
      row: row of the table, with all times.
      steady: whether EWM is the steady wind.
      number: seed of the turbulence.
      sea_number: seed of the waves.
    """

    campaign: Campaign
    row: LoadCaseRow
    variant: Variant
    fault: Fault | None
    steady: bool
    number: int | None
    sea_number: int | None = None

    @property
    def begin(self) -> float:
        """Time [s] at which the gust begins, or at which the event occurs without a gust."""
        row, variant = self.row, self.variant
        assert row.transient is not None and row.begin is not None
        if row.situation == "start":
            return row.transient + (variant.instant or 0.0)
        turn = 2.0 * math.pi / self.campaign.rotor_speed
        shift = 0.0 if row.situation == "locked" else (variant.azimuth or 0.0) / FULL * turn
        return round(row.transient + row.begin + shift, 6)

    @property
    def event(self) -> float:
        """Time [s] of the event; parked turbines have their faults from the beginning of the run."""
        if self.row.situation not in OPERATING:
            return 0.0
        late = 0.0 if self.row.situation == "start" else self.variant.instant or 0.0
        return round(self.begin + late, 6)


def wrapped(yaw: float) -> float:
    """Yaw error [deg] from above -180 to 180."""
    return yaw - FULL * math.ceil((yaw - 0.5 * FULL) / FULL)


def wind_content(s: Setting) -> dict[str, Any]:
    """Wind of a case."""
    c, v, model = s.campaign, s.variant, MODELS[s.variant.model]
    wind: dict[str, Any] = {"kind": "iec", "model": v.model}
    if model.name != "NWP":
        iec = c.iec_class if c.site is not None else c.wind_class
        wind["wind_class"] = iec if isinstance(iec, str) else iec.content()
        if isinstance(iec, str):
            wind["edition"] = c.edition
    if not v.model.startswith("EWM"):
        wind["speed"] = v.speed
    if model.kind == "transient":
        wind["begin"] = s.begin
    if v.sense is not None:
        wind["sign"] = v.sense
    if v.yaw:
        wind["direction"] = round(math.radians(wrapped(v.yaw)), 9)
    if s.row.situation in OPERATING and c.inclination:
        wind["upflow"] = c.inclination
    if s.steady:
        wind["steady"] = True
    if s.number is not None:
        wind["seed"] = s.number
        if c.turbulence:
            wind["turbulence"] = dict(c.turbulence)
    if c.metocean is not None and v.model in ("NTM", "ETM", "NWP"):
        shear = {"shear_exponent": c.metocean.shear_exponent}
        if v.model == "NWP":
            return {"kind": "steady", **shear, **_only(wind, "speed direction upflow")}
        wind["turbulence"] = shear | wind.get("turbulence", {})
    return wind if c.site is None else _at_site(wind, s)


def sea_content(s: Setting) -> dict[str, Any]:
    """Sea of a case; an embedded wave is the largest one that does not break."""
    c, waves, row = s.campaign, s.variant.waves, s.row
    assert waves is not None and c.metocean is not None and c.depth is not None
    assert row.transient is not None and row.duration is not None
    sea: dict[str, Any] = {"kind": "irregular", "height": waves.height, "period": waves.period, "seed": s.sea_number}
    if turn := wrapped((s.variant.yaw or 0.0) + waves.misalignment):
        sea["direction"] = round(math.radians(turn), 9)
    if waves.level:
        sea["level"] = waves.level
    if row.wave is not None:
        highest = breaking_height(SHORTEST * waves.period, c.depth + waves.level)
        height = round(min(row.wave * waves.height, highest), 3)
        when = row.transient + 0.5 * row.duration
        sea["crest"] = {"height": height, "of": "crest to trough", "time": when}
    if row.sea != "joint":
        near = wind_driven(c.metocean, s.variant.speed, c.hub_height)
        current = {"sub_surface": waves.current, "near_surface": near, "direction": sea.get("direction", 0.0)}
        if current := {key: value for key, value in current.items() if value}:
            sea["current"] = current
    return sea


def _at_site(wind: dict[str, Any], s: Setting) -> dict[str, Any]:
    """Wind with the turbulence and shear of the site; extreme winds and gusts keep the profile of the standard."""
    c, v = s.campaign, s.variant
    assert c.site is not None
    if v.model == "ETM":
        kept = _only(wind, "speed seed direction upflow")
        intensity = c.site.intensity_at(v.speed, extreme=True)
        shear = {"shear_exponent": c.site.shear_exponent}
        return {"kind": "turbulence", "intensity": intensity, "edition": c.edition, **kept, **shear, **c.turbulence}
    if v.model == "NWP":
        return {"kind": "steady", "shear_exponent": c.site.shear_exponent, **_only(wind, "speed direction upflow")}
    if not v.model.startswith("EWM") and v.model != "ECD":
        wind["intensity"] = c.site.intensity_at(v.speed)
    if v.model == "NTM":
        wind["intensity"] = c.site.waked_at(v.speed, c.edition, fatigue=s.row.type == "fatigue")
        wind["turbulence"] = {"shear_exponent": c.site.shear_exponent} | wind.get("turbulence", {})
    return wind


def _only(content: dict[str, Any], keys: str) -> dict[str, Any]:
    return {key: content[key] for key in keys.split() if key in content}


def operation_content(s: Setting) -> dict[str, Any]:
    """Controller, start, events and options of the operating situation of a case."""
    c, situation = s.campaign, s.row.situation
    if situation == "production":
        return {"controller": keyed(production_controller(c))}
    if situation == "idling":
        return {"controller": {"kind": "fixed"}, "start": {"rotor_speed": "idling", "pitch": c.idle_pitch}}
    if situation == "locked":
        azimuth = round(math.radians(s.variant.azimuth or 0.0), 9)
        start = {"rotor_speed": 0.0, "pitch": c.idle_pitch, "azimuth": azimuth}
        return {"controller": {"kind": "fixed"}, "start": start, "options": {"locked": ["generator"]}}
    supervised = keyed(start_controller(c) or c.controller)
    if situation == "start":
        return {"controller": supervised, "start": "standstill"}
    stop = {"at": s.event, "type": "request", "request": situation.replace(" ", "_")}
    return {"controller": supervised, "events": [stop]}


def _without_supervisor(events: list[dict[str, Any]], c: Campaign) -> list[dict[str, Any]]:
    """Events under a controller that follows neither requests to stop nor the state of the grid.

    All blades that can pitch go to feather, as in OpenFAST's manoeuvres; the generator has no torque in an emergency,
    and in a normal stop from halfway on.
    """
    replaced, stuck = [], {event["blade"] for event in events if event["type"] in ("pitch_stuck", "pitch_runaway")}
    for event in events:
        at, request = event["at"], event.get("request", "emergency_stop")
        if event["type"] in ("request", "grid_loss"):
            rate = c.normal_rate if request == "normal_stop" else c.emergency_rate
            free = [blade for blade in range(1, c.blades + 1) if blade not in stuck]
            replaced += [{"at": at, "type": "pitch_runaway", "blade": blade, "rate": rate} for blade in free]
            if request == "normal_stop":
                late = round(at + 0.5 * c.idle_pitch / rate, 6)
                replaced.append({"at": late, "type": "generator_fault"})
            elif all(e["type"] not in ("grid_loss", "generator_fault") for e in events):
                replaced.append({"at": at, "type": "generator_fault"})
        if event["type"] != "request":
            replaced.append(event)
    return replaced


def case_content(s: Setting) -> dict[str, Any]:
    """Content of the case file of a case, as :class:`meltemi.cases.case.LoadCase` reads it."""
    c, row = s.campaign, s.row
    assert row.transient is not None and row.duration is not None
    content: dict[str, Any] = {
        "turbine": c.turbine,
        "wind": wind_content(s),
        "duration": row.transient + row.duration,
        "transient": row.transient,
        "options": dict(c.options),
    }
    if row.situation in OPERATING and (c.pitch_imbalance or c.mass_imbalance):
        content["imbalance"] = {"pitch": [c.pitch_imbalance, -c.pitch_imbalance], "mass": [c.mass_imbalance]}
    if s.variant.waves is not None:
        content["sea"] = sea_content(s)
    environment = c.environment.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    if environment := environment | ({"air_density": c.site.air_density} if c.site is not None else {}):
        content["environment"] = environment
    of_situation = operation_content(s)
    content |= {key: value for key, value in of_situation.items() if key != "options"}
    content["options"] = merged(content["options"], of_situation.get("options", {}))
    if s.fault is not None:
        content["events"] = [
            *content.get("events", []),
            *s.fault.at(s.event, c.blades, c.normal_rate, c.emergency_rate),
        ]
        if s.fault.electrical:
            content["options"] |= {"electrical": "averaged"}
            if not c.electrical_system:
                content["electrical"] = "sized"
    if "events" in content and row.situation in OPERATING and content["controller"]["kind"] != "supervised":
        content["events"] = _without_supervisor(content["events"], c)
    if not content["options"]:
        del content["options"]
    return content


def missing(s: Setting) -> str:
    """Reason for which a case cannot run; empty if it can."""
    c = s.campaign
    if s.row.situation == "start" and start_controller(c) is None:
        return f"a start: controller {c.controller.kind} cannot start the turbine, supervised can"
    if s.row.sea is not None and c.metocean is not None and (key := c.metocean.lacks(s.row.sea)):
        return f"metocean: the site has no {key}"
    return ""


def timed(row: LoadCaseRow, duration: float, transient: float, begin: float) -> LoadCaseRow:
    """The row, with default times where it gives none."""
    defaults = {"duration": duration, "transient": transient, "begin": begin}
    return row.replace(**{name: value for name, value in defaults.items() if getattr(row, name) is None})
