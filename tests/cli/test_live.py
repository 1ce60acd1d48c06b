"""``meltemi live``: the session behind the page, its server, and the page in a browser."""

from __future__ import annotations

import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from threading import Thread, active_count
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.compiler import View
from meltemi.core.errors import InputError, Status
from meltemi.maths.vectors import Vec
from meltemi.scene.record import unpacked
from meltemi.turbine.definition import Turbine
from meltemi.view.commands import live as command
from meltemi.view.commands.live_server import MOST_CONNECTIONS, MOST_WAITING, LiveServer
from meltemi.view.live_run import LAG, SEA_PERIOD, LiveRun, LiveWind, WindState
from meltemi.view.live_session import Session
from meltemi.view.sea_surface import POINTS
from meltemi.wind.velocity import WindField, WindParameters, wind_velocity

pytest.importorskip("websockets", reason="needs websockets")
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect


@pytest.fixture(scope="module")
def turbine() -> Turbine:
    found = meltemi.load_turbine("nrel5mw")
    assert isinstance(found, Turbine)
    return found


@pytest.fixture(scope="module")
def shared(turbine: Turbine) -> Session:
    return Session(turbine, "baseline", wind_speed=8.0, turbulence=0.02)


@pytest.fixture
def session(shared: Session) -> Session:
    """In its first state: the baseline controller at 8 m/s, nearly without turbulence."""
    shared.values |= {"wind_speed": 8.0, "turbulence": 2.0, "yaw_error": 0.0, "power_limit": 5.0}
    shared.controller = "baseline"
    shared.restart()
    return shared


def means(session: Session, seconds: float) -> dict[str, float]:
    """Means of the channels while the session runs on."""
    pieces = [unpacked(content) for _ in range(round(seconds / 2.0)) if (content := session.piece(2.0))]
    lines = [line["name"] for plot in session.plots for line in plot["lines"]]
    values = np.concatenate([piece.track("plot")[1:] for piece in pieces]).mean(axis=0)
    return dict(zip(lines, values.tolist(), strict=True))


# ---------------------------------------------------------------- session


@pytest.mark.slow
def test_wind_speed_and_yaw_error_change_the_power(session: Session) -> None:
    first = means(session, 10.0)
    assert first["wind_x"] == pytest.approx(8.0, rel=0.05)
    session.obey({"set": "wind_speed", "value": 10})
    means(session, 30.0)
    higher = means(session, 10.0)
    assert higher["wind_x"] == pytest.approx(10.0, rel=0.05)
    assert higher["generator_power"] > 1.6 * first["generator_power"]
    session.obey({"set": "yaw_error", "value": 30})
    means(session, 20.0)
    assert means(session, 10.0)["generator_power"] < 0.85 * higher["generator_power"]


@pytest.mark.slow
def test_turbulence_changes_the_scatter(session: Session) -> None:
    def scatter() -> float:
        pieces = [unpacked(session.piece(2.0) or b"") for _ in range(10)]
        return float(np.std([piece.track("plot")[1:, 0] for piece in pieces]))

    calm = scatter()
    session.obey({"set": "turbulence", "value": 20})
    means(session, 10.0)
    assert scatter() > 4.0 * calm


def test_the_wind_changes_without_a_jump(turbine: Turbine) -> None:
    wind = LiveWind(turbine, WindState(8.0, 0.2, 0.1))
    run = LiveRun(meltemi.build(turbine), wind)
    run.piece(40)
    field, t = WindField("floats", run.simulation.case.arrays), run.simulation.time
    points = [Vec(x, y, z) for x in (-5.0, 0.0) for y in (-40.0, 30.0) for z in (40.0, 120.0)]

    def fluctuation() -> Any:
        found = np.array([[u.x, u.y, u.z] for p in points for u in [wind_velocity(p, t, field)]])
        still = np.array([wind._mean[0, :, 0, 0]])
        speed = np.interp([p.z for p in points], wind.box.bottom + wind.box.dz * np.arange(still.size), still[0])
        direction = View(WindParameters, run.simulation.case["wind"])["box_direction"]
        found[:, 0] -= wind.air.speed * speed * np.cos(direction)
        found[:, 1] += wind.air.speed * speed * np.sin(direction)
        return found / (wind.air.speed * wind.air.intensity)

    before = fluctuation()
    wind.change(WindState(16.0, 0.1, 0.1), t, run.simulation.case["wind"])
    assert np.abs(fluctuation() - before).max() < 1e-4
    now = WindState(8.0, 0.1).towards(WindState(18.0, 0.1), LAG)
    assert now.speed == pytest.approx(18.0 - 10.0 / np.e)


def test_faults_act_at_once_and_end(session: Session) -> None:
    assert session.state()["faults"] == []
    session.obey({"fault": "grid_loss", "on": True})
    assert session.state()["faults"] == ["grid_loss"]
    lost = means(session, 2.0)
    assert abs(lost["generator_power"]) < 0.3
    assert session.run.simulation.log()[-1].what == "grid lost"
    session.obey({"fault": "grid_loss", "on": False})
    means(session, 2.0)
    assert means(session, 2.0)["generator_power"] > 1.0
    assert session.state()["log"][-1][2] == "grid lost: over"


@pytest.mark.slow
def test_a_supervised_turbine_follows_limit_and_stop(session: Session) -> None:
    session.obey({"set": "wind_speed", "value": 14})
    session.obey({"controller": "supervised"})
    assert session.number > 1 and session.run.time == 0.0
    session.obey({"set": "power_limit", "value": 3})
    means(session, 40.0)
    assert means(session, 10.0)["generator_power"] == pytest.approx(3.0, rel=0.05)
    session.obey({"set": "power_limit", "value": 5})
    assert means(session, 20.0)["generator_power"] > 3.5
    session.obey({"request": "emergency_stop"})
    means(session, 20.0)
    assert means(session, 2.0)["rotor_speed"] < 4.0
    assert "emergency stop" in session.state()["log"][-1][2]


@pytest.mark.long
def test_load_control_reduces_the_scatter_of_root_moments(session: Session) -> None:
    session.obey({"set": "wind_speed", "value": 14})

    def scatter(name: str) -> float:
        session.obey({"controller": name})
        means(session, 20.0)
        lines = [line["name"] for plot in session.plots for line in plot["lines"]]
        column = lines.index("root_moment_out_of_plane_1")
        return float(np.std([unpacked(session.piece(2.0) or b"").track("plot")[1:, column] for _ in range(20)]))

    assert scatter("ipc") < 0.7 * scatter("supervised")
    assert scatter("cpfc") < 0.7 * scatter("supervised")


def test_an_own_controller(turbine: Turbine, tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from meltemi.control import ConstantController\ndef controller(turbine):\n    return ConstantController()\n"
    )
    own = Session(turbine, str(file))
    assert own.controller == "mine" and own.state()["operator"]
    assert own.piece(0.1)
    with pytest.raises(InputError, match="controller 'ipd': did you mean 'ipc'"):
        Session(turbine, "ipd")


def test_memory_is_constant(session: Session) -> None:
    run = session.run.simulation
    arrays, box = (run.loop.output, run.case["q"], run.case["box"]), run.case["box"].copy()
    session.obey({"set": "wind_speed", "value": 12})
    sizes = {len(session.piece(2.0) or b"") for _ in range(15)}
    assert all(a is b for a, b in zip(arrays, (run.loop.output, run.case["q"], run.case["box"]), strict=True))
    assert session.wind.box.velocity is run.case["box"] or np.shares_memory(session.wind.box.velocity, run.case["box"])
    assert not np.array_equal(box, run.case["box"])
    assert max(sizes) < 20_000
    assert len(run.loop.output) <= 43


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ({"set": "wind_speed", "value": 99}, "wind_speed must be from 3 to 25 m/s, found 99"),
        ({"set": "wind_speed", "value": float("nan")}, "found nan"),
        ({"set": "wind_sped", "value": 9}, "no slider 'wind_sped'; did you mean 'wind_speed'"),
        ({"set": "turbulence", "value": True}, "turbulence must be from"),
        ({"set": "power_limit", "value": 3}, "baseline does not follow a power limit"),
        ({"request": "normal_stop"}, "ignores requests"),
        ({"fault": "fire", "on": True}, "not understood"),
        ({"controller": "none"}, "not understood"),
        (None, "not understood"),
    ],
)
def test_wrong_messages_change_nothing(session: Session, message: Any, words: str) -> None:
    before = session.state()
    with pytest.raises(InputError, match=re.escape(words)):
        session.obey(message)
    assert session.state() == before


def test_a_run_that_diverges_says_why_and_restarts(session: Session) -> None:
    session.run.simulation.case["v"][0] = np.nan
    session.piece(0.1)
    assert session.run.simulation.status is Status.DIVERGED
    assert "at t = " in session.state()["ended"]
    assert session.piece(0.1) is None
    session.obey({"reset": True})
    assert session.state()["ended"] == "" and session.piece(0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["nrel5mw-monopile", "nrel5mw-spar"])
def test_a_turbine_in_the_sea(name: str) -> None:
    """On its pile and afloat: the surface that is drawn at the tower is the elevation of the sea."""
    machine = meltemi.load_turbine(name)
    assert isinstance(machine, Turbine)
    sea = meltemi.environment.IrregularSea(height=3.0, period=9.0, repeat=SEA_PERIOD, seed=2)
    afloat = Session(machine, "baseline", wind_speed=8.0, sea=sea)
    first = afloat.run.first.about["turbine"]["water"]
    assert (
        first["floats"] == (name == "nrel5mw-spar") and first["reach"] > 0.0 and (first["lines"] or not first["floats"])
    )
    waves = sea.components(first["depth"], SEA_PERIOD)
    for _ in range(2):
        scene = unpacked(afloat.piece(2.0) or b"")
        surface = scene.track("sea")[:, 0, POINTS // 2, 0]
        now = scene.about["begin"] + scene.about["steps"]["sea"] * np.arange(len(surface))
        rise = (waves.amplitude * np.exp(1j * np.outer(now, waves.frequency))).real.sum(axis=1)
        assert np.ptp(rise) > 0.2 and surface == pytest.approx(rise, abs=0.03)
        column = [line["column"] for plot in afloat.plots for line in plot["lines"] if line["name"] == "wave_elevation"]
        plotted = scene.track("plot")[::5, column[0]]
        expected = np.interp(scene.about["begin"] + 0.25 * np.arange(len(plotted)), now, rise)
        assert plotted == pytest.approx(expected, abs=0.05)
    if first["floats"]:
        afloat.obey({"fault": "line", "on": True})
        assert afloat.piece(0.5) and "line" in afloat.state()["faults"]


def test_events_still_to_come_are_not_lost(turbine: Turbine) -> None:
    events = [{"at": 5.0, "type": "grid_loss"}]
    run = meltemi.Simulation(meltemi.Run(meltemi.build(turbine), 8.0, duration=6.0, events=events))
    with pytest.raises(InputError, match="still to come"):
        run.act(meltemi.events.Brake(at=0.0))
    with pytest.raises(InputError, match="expected 1 to 120 samples"):
        run.stream(400)


# ---------------------------------------------------------------- server


@pytest.fixture
def server() -> Iterator[LiveServer]:
    with LiveServer(lambda: "<title>page</title>") as found:
        yield found


def answer(server: LiveServer, path: str, host: str | None = None) -> tuple[int, str, Any]:
    connection = HTTPConnection(server.host, timeout=5.0)
    connection.request("GET", path, headers={"Host": host or server.host})
    found = connection.getresponse()
    text = found.read().decode()
    connection.close()
    return found.status, text, found.headers


def test_the_page_needs_token_and_host(server: LiveServer) -> None:
    path = server.url.removeprefix(f"http://{server.host}")
    status, text, headers = answer(server, path)
    assert (status, text) == (200, "<title>page</title>")
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    other = "y" if path[-2] == "x" else "x"
    for wrong in ("/", f"{path[:-2]}{other}/", f"/{'a' * 32}/"):
        assert answer(server, wrong)[0] == 403
    port = server.host.partition(":")[2]
    for host in ("evil.example", f"evil.example:{port}", f"localhost:{port}"):
        assert answer(server, path, host)[0] == 403
    with pytest.raises(InputError, match=f"--port {port}: Address already in use"):
        LiveServer(lambda: "", int(port))


def test_the_socket_needs_token_origin_and_host(server: LiveServer, caplog: pytest.LogCaptureFixture) -> None:
    address, good = server.url.replace("http", "ws") + "socket", f"http://{server.host}"
    for origin in (None, "http://evil.example", "https://" + server.host, "null"):
        with pytest.raises(InvalidStatus, match="403"), connect(address, origin=origin):  # type: ignore[arg-type]
            pass
    wrong = f"ws://{server.host}/{'a' * 32}/socket"
    with pytest.raises(InvalidStatus, match="403"), connect(wrong, origin=good):  # type: ignore[arg-type]
        pass
    headers = {"Host": "evil.example"}
    with pytest.raises((InvalidStatus, ValueError)), connect(address, origin=good, additional_headers=headers):  # type: ignore[arg-type]
        pass
    assert not server.open
    with connect(address, origin=good) as page:  # type: ignore[arg-type]
        assert list(server.received(5.0)) == [{"opened": True}]
        page.send('{"a": 1}')
        page.send("{")
        assert [*server.received(5.0), *server.received(0.5)] == [{"a": 1}, None]
        with connect(address, origin=good) as second:  # type: ignore[arg-type]
            list(server.received(5.0))
            server.send({"b": 2})
            assert second.recv(5.0) == '{"b": 2}'
            with pytest.raises(ConnectionClosed, match="another window"):
                page.recv(5.0)
    assert caplog.records == []


def test_a_browser_that_is_killed_closes_the_page(server: LiveServer) -> None:
    with connect(server.url.replace("http", "ws") + "socket", origin=f"http://{server.host}") as page:  # type: ignore[arg-type]
        list(server.received(5.0))
        assert server.open
        page.socket.shutdown(socket.SHUT_RDWR)
        end = time.monotonic() + 5.0
        while server.closed_at is None:
            assert time.monotonic() < end
            time.sleep(0.01)
    assert not server.open


def test_what_fails_in_its_threads_prints_no_traceback(caplog: pytest.LogCaptureFixture) -> None:
    """Connections that break off at a bad moment fail in websockets itself, which logs it; here the page fails."""
    with LiveServer(lambda: {}["page"]) as server:
        assert answer(server, server.url.partition(server.host)[2])[0] == 500
    assert caplog.records == []


def test_idle_connections_are_bounded(server: LiveServer) -> None:
    before, port = active_count(), int(server.host.partition(":")[2])
    lines = [socket.create_connection(("127.0.0.1", port)) for _ in range(5 * MOST_CONNECTIONS)]
    try:
        assert all(line.recv(1) == b"" for line in lines[-3:])  # closed at once
        end = time.monotonic() + 5.0
        while active_count() - before > 2 * MOST_CONNECTIONS:
            assert time.monotonic() < end
    finally:
        for line in lines:
            line.close()
    end = time.monotonic() + 5.0
    while active_count() > before:
        assert time.monotonic() < end
        time.sleep(0.01)
    assert answer(server, server.url.removeprefix(f"http://{server.host}"))[0] == 200


def test_messages_end_with_their_page_and_are_bounded(server: LiveServer) -> None:
    address, good = server.url.replace("http", "ws") + "socket", f"http://{server.host}"
    with connect(address, origin=good) as page:  # type: ignore[arg-type]
        for i in range(8):
            page.send(f'{{"set": {i}}}')
        time.sleep(0.2)
        found = server.received(5.0)
        assert [next(found), next(found)] == [{"opened": True}, {"set": 0}]
    end = time.monotonic() + 5.0
    while server.open:
        assert time.monotonic() < end
    assert list(found) == list(server.received(0.0)) == []
    with connect(address, origin=good) as page:  # type: ignore[arg-type]
        for i in range(2 * MOST_WAITING):
            page.send(f'{{"set": {i}}}')
        time.sleep(0.5)
        assert len(list(server.received(5.0))) == MOST_WAITING
    with connect(address, origin=good) as page:  # type: ignore[arg-type]
        for _ in range(5):
            page.send('{"reset": true}')
        time.sleep(0.2)
        assert list(server.received(5.0)) == [{"opened": True}, {"reset": True}]


def test_an_error_never_ends_it(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "GRACE", 0.2)
    monkeypatch.setattr(Session, "restart", lambda self: [][0])
    monkeypatch.setattr(Session, "piece", lambda self, seconds: {}["none"])
    said: list[str] = []
    with LiveServer(lambda: "") as server:

        def page() -> None:
            with connect(server.url.replace("http", "ws") + "socket", origin=f"http://{server.host}") as line:  # type: ignore[arg-type]
                for message in ("[" * 2000, "[" * 900 + "]" * 900, '{"reset": true}', "1" * 2000):
                    line.send(message)
                    while not (found := str(line.recv(5.0))).startswith('{"error"') or "KeyError" in found:
                        pass
                    said.append(found)

        reader = Thread(target=page)
        reader.start()
        command.serve(session, server)
        reader.join()
    assert ["understood" in text for text in said] == [True, True, False, True]
    assert "IndexError" in said[2]


@pytest.mark.slow
def test_it_runs_at_the_speed_and_ends_with_its_page(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "GRACE", 0.2)
    with LiveServer(lambda: "") as server:
        address = server.url.replace("http", "ws") + "socket"
        found: dict[str, Any] = {"pieces": 0}

        def page() -> None:
            with connect(address, origin=f"http://{server.host}") as line:  # type: ignore[arg-type]
                line.send('{"playing": true, "speed": 5}')
                line.send('{"set": "wind_speed", "value": 50}')
                began = time.monotonic()
                while time.monotonic() < began + 2.0:
                    message = line.recv(5.0)
                    if isinstance(message, bytes):
                        found["pieces"] += 1
                    elif message.startswith('{"error"'):
                        found["error"] = message
                line.send('{"playing": false, "speed": 5}')

        reader = Thread(target=page)
        reader.start()
        command.serve(session, server)
        reader.join()
        assert 6.0 < session.run.time < 12.0
        assert found["pieces"] > 10
        assert "from 3 to 25 m/s" in found["error"]


# ---------------------------------------------------------------- command and browser

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)


def started(*options: str) -> tuple[subprocess.Popen[str], str]:
    """The command, and the address that it prints."""
    order = [sys.executable, "-m", "meltemi.app.cli", "live", "nrel5mw", "--no-browser", *options]
    process = subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        if found := re.search(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", line):
            return process, found[0]
    raise AssertionError("no address")


@pytest.mark.slow
def test_ctrl_c_ends_it() -> None:
    process, _ = started("--controller", "baseline")
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate(timeout=10.0)
    assert process.returncode == 0
    assert "interrupted" in out and "next: meltemi run nrel5mw --wind-speed 10" in out
    assert "Traceback" not in out


def until(page: Any, expression: str) -> None:
    """Wait until an expression is true; the page's policy forbids ``wait_for_function`` to evaluate it there."""
    end = time.monotonic() + 40.0
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        time.sleep(0.05)


@pytest.mark.long
@pytest.mark.skipif(BROWSER is None, reason="needs chromium or google-chrome")
def test_a_browser_draws_it_moves_a_slider_and_ends_it() -> None:
    play = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    process, url = started("--controller", "baseline", "--speed", "5", "--turbulence", "0")
    options = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    faults: list[str] = []
    try:
        with play.sync_playwright() as machine:
            browser = machine.chromium.launch(executable_path=BROWSER, args=options)
            page = browser.new_page(viewport={"width": 500, "height": 400})
            page.on("pageerror", lambda error: faults.append(str(error)))
            page.on("console", lambda line: faults.append(line.text) if line.type == "error" else None)
            page.goto(url)
            until(page, "window.view && view.frames >= 5 && view.live.now() > 2")
            assert page.evaluate("document.querySelectorAll('#plots canvas').length") == 7
            frames = page.evaluate("view.frames")
            page.evaluate(
                "() => { const s = document.querySelector('[name=wind_speed]'); s.value = 16;"
                "s.dispatchEvent(new Event('input')); }"
            )
            latest = "view.live.series.value(view.live.series.rows - 1, 0)"
            until(page, f"{latest} > 13")
            until(page, f"view.frames > {frames + 3}")
            # plots without samples, as at a restart before the first piece of the new run
            page.evaluate("view.live.socket.onmessage = null, view.live.series.clear(0), view.state.redraw = true")
            until(page, f"view.frames > {page.evaluate('view.frames') + 1}")
            browser.close()
        out, _ = process.communicate(timeout=20.0)
    finally:
        process.kill()
    assert process.returncode == 0
    assert faults == []
    assert "next: meltemi run nrel5mw --wind-speed 16" in out
