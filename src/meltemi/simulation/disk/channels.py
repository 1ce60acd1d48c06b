"""Channels of a power-coefficient turbine: its part of the catalogue, and additional ones."""

from __future__ import annotations

from meltemi.core.errors import InputError
from meltemi.simulation.channels import Channel, ChannelSet, catalogue, channels_of_group, find, standard
from meltemi.simulation.disk.rotor import DiskModel
from meltemi.turbine.power_turbine import TableCoefficient

WHOLE = ("summary", "pitch", "demands", "outside", "electric")
"""Arrays that are fully available."""
SOME = {
    "machine": ("azimuth", "rotor_speed"),
    "rotor": ("thrust", "torque", "skew", "tip_ratio"),
    "chain": ("rotor_acceleration", "apex_moment_x"),
    "drive": ("yaw_command", "yaw_drive_rate", "brake_torque"),
    "q": ("yaw", "generator", "drivetrain"),
    "v": ("yaw", "generator", "drivetrain"),
}
"""Arrays with only these rows available."""


def disk_channels(model: DiskModel) -> dict[str, Channel]:
    """All channels of a model, by name."""
    turbine = model.turbine
    missing = [] if turbine.drivetrain.stiffness is not None else [("q", "drivetrain"), ("v", "drivetrain")]
    if not (isinstance(turbine.coefficient, TableCoefficient) and turbine.coefficient.thrust is not None):
        missing.append(("rotor", "thrust"))
    parts = tuple(channel for part in model.parts for channel in part.channels())
    further = parts + channels_of_group("disk")
    channels = catalogue(ChannelSet(blades=model.n_blades, coordinates=model.coordinates, further=further))
    return {
        name: channel
        for name, channel in channels.items()
        if channel.source not in missing
        and (channel.source[0] in (*WHOLE, "disk_flow") or channel.source[1] in SOME.get(channel.source[0], ()))
    }


def find_disk_channel(name: str, model: DiskModel, available: dict[str, Channel]) -> Channel:
    """A channel by its name.

    Raises:
      InputError: unknown name, or a channel that only an aeroelastic turbine has.
    """
    try:
        return find(name, available)
    except InputError:
        try:
            known = find(name, standard())
        except InputError:
            known = None
        if known is None:
            raise
    raise InputError(
        f"no channel {name!r}: {model.turbine.name} is a power-coefficient turbine, without the blades and tower for "
        f"{known.description!r}; use an aeroelastic turbine"
    )
