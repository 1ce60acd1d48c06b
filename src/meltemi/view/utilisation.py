"""Members of a frame in a view, coloured by utilisation if the run recorded their loads."""

from __future__ import annotations

from dataclasses import replace

from meltemi.scene.record import Scene
from meltemi.simulation.result import Result


def with_utilisation(scene: Scene, result: Result) -> tuple[Scene, str]:
    """The scene of a turbine on a frame with the largest utilisation of each member, and words on it.

    Members without a recorded section keep their colour. Loads are without partial safety factors.

    Args:
      scene: scene of the run.
      result: its result.
    """
    water = scene.about["turbine"].get("water") or {}
    if "frame" not in water:
        return scene, ""
    from meltemi.frames.definition import Frame
    from meltemi.frames.joints.fatigue import largest_utilisations
    from meltemi.frames.joints.settings import JointSettings
    from meltemi.frames.loads import section_loads

    frame = Frame(**water["frame"])
    used: dict[str, float] = {}
    for (name, _), (ratio, _) in largest_utilisations(frame, section_loads(frame, result.evaluated)).items():
        used[name] = max(ratio, used.get(name, 0.0))
    drawn = [used.get(name) for name, member in frame.members.items() if member.kind == "beam"]
    shown = {key: value for key, value in water.items() if key != "frame"} | {"utilisation": drawn}
    scene = replace(scene, about=scene.about | {"turbine": scene.about["turbine"] | {"water": shown}})
    if not used:
        return scene, ""
    worst, s = max(used, key=lambda name: used[name]), JointSettings()
    return scene, (
        f" Members are coloured by utilisation ({s.standard}, yield stress {1e-6 * s.yield_stress:g} MPa, loads "
        f"without partial safety factors): white 0, dark {used[worst]:.2f}, of member {worst}."
    )
