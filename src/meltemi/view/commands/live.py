"""``meltemi live``: a simulation that runs in the browser, with sliders and faults."""

from __future__ import annotations

from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any

from meltemi.app.options import CONTROLLER, CONTROLLERS, SeaOption, TurbineArgument, load_aeroelastic, sea_of_options
from meltemi.app.signatures import Range
from meltemi.app.terminal import say, suggest
from meltemi.core.errors import MeltemiError
from meltemi.view.commands.view import ThemeOption

if TYPE_CHECKING:
    from meltemi.view.commands.live_server import LiveServer
    from meltemi.view.live_session import Session

GRACE = 5.0
"""[s] after the page has closed, in which it may be opened again (reload), before the command ends."""
PIECES = 10.0
"""[Hz] rate of the pieces that the page receives, at real time and faster."""
SPEEDS = Range(0.25, 20)


def live(
    turbine: TurbineArgument,
    wind_speed: Annotated[float, "Mean wind speed at hub height at the start [m/s]."] = 10.0,
    turbulence: Annotated[float, "Turbulence intensity at the start."] = 0.1,
    seed: Annotated[int, "Seed of the turbulence."] = 1,
    sea: SeaOption = None,
    controller: Annotated[str, f"At the start: {CONTROLLER}.", CONTROLLERS] = "supervised",
    speed: Annotated[float, "Simulated time over real time at the start, 0.25 to 20.", SPEEDS] = 1.0,
    port: Annotated[int, "Port on 127.0.0.1 [a free one]."] = 0,
    browser: Annotated[bool, "Open the page in the browser."] = True,
    theme: ThemeOption = None,
) -> None:
    """Run a turbine in the browser in real time, with sliders for the wind, faults and a menu of controllers."""
    from meltemi.view.commands.live_server import LiveServer
    from meltemi.view.live_session import Session

    machine = load_aeroelastic(turbine, "live")
    around = None
    if sea is not None:
        from meltemi.sea.kinds import sea_of
        from meltemi.view.live_run import SEA_PERIOD

        around = sea_of(sea_of_options(sea) | {"repeat": SEA_PERIOD}, "--sea")
    session: Session
    pages = lambda: session.view(theme or "", speed).html  # noqa: E731
    with LiveServer(pages, port) as server:
        session = Session(
            machine, controller, wind_speed=wind_speed, turbulence=turbulence, seed=seed, sea=around, tell=say
        )
        session.tell = lambda line: server.send({"busy": line})
        print(f"{machine.name} runs at {server.url}", flush=True)
        print("closing the page or Ctrl-C ends it", flush=True)
        if browser:
            import webbrowser

            webbrowser.open(server.url)
        try:
            serve(session, server, speed)
        except KeyboardInterrupt:
            say("interrupted")
    print(f"{session.run.time:.1f} s simulated since the last start")
    arguments = ("--wind-speed", f"{session.values['wind_speed']:g}", "--duration", 60, "--view")
    suggest("run", turbine if not Path(turbine).is_file() else Path(turbine), *arguments)


def serve(session: Session, server: LiveServer, speed: float = 1.0) -> None:
    """Run a session until its page closes.

    Args:
      session: session that the page controls.
      server: server of the page.
      speed: simulated time over real time at the start.

    Raises:
      KeyboardInterrupt: Ctrl-C while a controller in Python was running.
    """
    sent: dict[str, Any] = {}
    playing, due = True, monotonic()
    while server.closed_at is None or monotonic() < server.closed_at + GRACE:
        idle = not (server.open and playing) or session.run.simulation.finished
        for message in server.received(0.1 if idle else due - monotonic()):
            match message:
                case {"opened": True}:
                    sent = {}
                case {"playing": bool(play), "speed": int(wanted) | float(wanted)} if (
                    SPEEDS.least <= wanted <= SPEEDS.most
                ):
                    playing, speed = play, float(wanted)
                case _:
                    try:
                        session.obey(message)
                    except Exception as error:  # an invalid request of a page never ends the command
                        server.send({"error": _words(error)})
            due = monotonic()
        if idle:
            due = monotonic()
        elif monotonic() >= due:
            seconds = max(speed, 0.5) / PIECES
            try:
                if (piece := session.piece(seconds)) is not None:
                    server.send(piece)
            except Exception as error:
                playing = False
                server.send({"error": _words(error)})
            # delays are recovered, up to a quarter of a second
            due = max(due + seconds / speed, monotonic() - 0.25)
        if session.run.simulation.interrupted:
            raise KeyboardInterrupt
        if server.open and (now := session.state()) != sent:
            server.send({"state": now})
            sent = now


def _words(error: Exception) -> str:
    return str(error) if isinstance(error, MeltemiError) else f"{type(error).__name__}: {error}"
