"""The three-dimensional view: what a run records for it, and what a browser draws of it."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from pathlib import Path
from queue import Queue
from threading import Thread
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import meltemi
from meltemi import Model, Result
from meltemi.analyses.campbell import campbell
from meltemi.compiler import View
from meltemi.core.errors import InputError
from meltemi.maths.vectors import Vec
from meltemi.postprocess.files import read_netcdf, write_netcdf
from meltemi.scene.motion import POSITION_ERROR, cuts
from meltemi.scene.record import Scene, packed, track_arrays, unpacked
from meltemi.simulation.case import Case
from meltemi.turbine.exchange import BladeFrame
from meltemi.view import view, viewer
from meltemi.view.mode_scenes import modes_scene
from meltemi.wind.fields import SteadyWind, WindSeries, wind_field
from meltemi.wind.velocity import series_now, wind_velocity

DURATION = 8.0
NOW = 6.3
"""[s] instant at which pictures are compared."""


@pytest.fixture(scope="module")
def seen(model: Model) -> Result:
    """A run in a gust, so that everything moves."""
    wind = WindSeries(time=[0.0, 3.0, 6.0], speed=[10.0, 14.0, 11.0], direction=[0.1, 0.1, 0.1], exponent=0.2)
    return meltemi.simulate(model, wind, duration=DURATION, view=True, channels=["all"])


@pytest.fixture(scope="module")
def scene(seen: Result) -> Scene:
    assert seen.scene is not None
    return seen.scene


def body(scene: Scene) -> Any:
    """Tower top (T, 3), its rotation (T, 3), yaw (T,) and pitch (T, B)."""
    values = scene.track("body")
    return values[:, :3], values[:, 3:6], values[:, 6], values[:, 7:]


def test_tips_are_those_of_the_channels(seen: Result, scene: Scene) -> None:
    tip, (_, _, _, pitch) = scene.track("blade")[:, :, -1], body(scene)
    for b in range(3):
        # pitched axes are coned axes turned by the pitch angle about -z
        turned = Rotation.from_rotvec(np.outer(-pitch[:, b], [0.0, 0.0, 1.0])).apply(tip[:, b, :3])
        for k, name in enumerate(("out_of_plane", "in_plane")):
            expected = seen[f"tip_{name}_{b + 1}"]
            # ideal actuators jump at each step: the mean of both pitch angles acts, the channel shows the new one
            jump = 0.5 / 60.0 * np.gradient(seen[f"pitch_{b + 1}"], seen.time) * seen[f"tip_out_of_plane_{b + 1}"]
            assert (np.abs(turned[:, k] - expected) < 2e-3 + scene.about["accuracy"] + 2.0 * np.abs(jump)).all()
            assert np.ptp(expected) > 0.1
        assert np.abs(tip[:, b, 5] - seen[f"tip_twist_{b + 1}"]).max() < 0.004


def test_positions_are_within_the_stated_accuracy(scene: Scene) -> None:
    assert 0.0 < scene.about["accuracy"] <= POSITION_ERROR * scene.about["turbine"]["rotor_radius"]


def test_frames_are_those_of_the_channels(seen: Result, scene: Scene) -> None:
    top, _, yaw, pitch = body(scene)
    azimuth = np.remainder(scene.arrays["azimuth"].astype(float) - seen["azimuth"] + 1.0, 2.0 * np.pi) - 1.0
    assert np.abs(azimuth).max() < 1e-4
    assert np.all(np.diff(scene.arrays["azimuth"]) > 0.0)
    assert np.abs(pitch - np.stack([seen[f"pitch_{b}"] for b in (1, 2, 3)], axis=1)).max() < 1e-4
    assert np.abs(yaw - seen["nacelle_yaw"]).max() < 1e-5
    assert np.abs(top[:, 0] - seen["tower_top_fore_aft"]).max() < 1e-3
    shape = scene.arrays["tower_shape"][:, -1, 0]
    assert np.abs(scene.track("tower") @ shape - seen["tower_top_fore_aft"]).max() < 2e-3


def test_loads_are_those_of_the_channels(seen: Result, scene: Scene) -> None:
    bending, tower = scene.track("bending"), scene.track("tower_bending")[:, 0]
    largest = scene.about["largest"]
    every = round(scene.about["steps"]["bending"] / 0.05)
    assert np.abs(bending[:, 0, 0, 1] - seen["root_moment_flap_1"][::every]).max() < 0.032 * largest["bending"]
    assert np.abs(tower[:, 0, 1] - seen["tower_base_moment_fore_aft"][::every]).max() < 0.032 * largest["tower_bending"]
    every = round(scene.about["steps"]["air"] / 0.05)
    force = scene.track("air")[:, 1, 14, 0] - seen["node_15_normal_force_2"][::every]
    assert np.abs(force).max() < 0.032 * largest["air"]


def test_stations_of_loads_begin_at_the_root_and_end_at_the_tower_top(model: Model) -> None:
    found = cuts(model)
    assert found.blade == pytest.approx([61.5 * i / 9.0 for i in range(9)])
    assert found.tower == pytest.approx([87.6 * i / 6.0 for i in range(1, 7)])


def test_wind_is_that_of_the_run(seen: Result, scene: Scene, model: Model) -> None:
    where, i, j, t = scene.about["wind"], 7, 2, 4.0
    wind = WindSeries(time=[0.0, 3.0, 6.0], speed=[10.0, 14.0, 11.0], direction=[0.1, 0.1, 0.1], exponent=0.2)
    field = wind_field(wind, model.turbine.hub_height, model.turbine.rotor_diameter)
    across = np.linspace(-where["half_width"], where["half_width"], where["points"])[j]
    point = Vec(across * np.sin(0.1), across * np.cos(0.1), where["heights"][i])
    series_now(t, field)
    expected = wind_velocity(point, t, field)
    found = scene.track("wind")[round(t / scene.about["steps"]["wind"]), i, j]
    assert np.abs(found - [expected.x, expected.y, expected.z]).max() < 0.06
    assert where["direction"] == pytest.approx(0.1)


def test_only_runs_that_ask_for_it_record_it(model: Model, seen: Result) -> None:
    plain = meltemi.simulate(model, 10.0, duration=1.0)
    assert plain.scene is None
    with pytest.raises(InputError, match="motion of the turbine is not recorded; repeat the run with: meltemi run"):
        view.result_view({"plain": plain})
    with pytest.raises(InputError, match="one or two results, or those of a farm, found 3"):
        view.result_view({"a": seen, "b": seen, "c": seen})


@pytest.mark.slow
def test_what_has_a_view(seen: Result, model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    winds = [SteadyWind(speed=9.0), meltemi.TurbulentWind(speed=9.0, intensity=0.1, points=5)]
    titles = [thing.view().spec["title"] for thing in (seen, model, model.turbine, *winds)]
    assert titles == ["nrel5mw", *["nrel5mw: modes in vacuum"] * 2, "Wind", "Wind"]
    found = seen.view()
    widget = "application/vnd.jupyter.widget-view+json"
    pytest.importorskip("anywidget")
    assert set(found._repr_mimebundle_()) == {"text/plain", "text/html", widget}
    monkeypatch.setattr("meltemi.core.extras.installed", lambda name: False)
    with pytest.raises(InputError, match="pip install 'anywidget"):
        _ = seen.view().widget
    assert set(seen.view()._repr_mimebundle_()) == {"text/plain", "text/html"}


def test_recording_changes_no_other_channel(model: Model) -> None:
    own = meltemi.Stations(blade=(20.0,), tower=(40.0,))
    runs = [meltemi.simulate(model, 10.0, duration=1.0, stations=own, view=on) for on in (False, True)]
    assert runs[0].names == runs[1].names
    assert np.array_equal(runs[0].data, runs[1].data)


def test_turbines_without_blades_are_refused() -> None:
    disk = meltemi.build(meltemi.load_turbine("pmsg20mw"))
    with pytest.raises(InputError, match="view"):
        meltemi.simulate(disk, 10.0, duration=1.0, view=True)


def test_files_keep_the_scene(seen: Result, scene: Scene, tmp_path: Path) -> None:
    few = replace(seen, channels=seen.channels[:3], data=seen.data[:, :3])
    again = read_netcdf(write_netcdf(few, tmp_path / "result.nc")).scene
    assert again is not None
    assert again.about == json.loads(json.dumps(scene.about))
    assert all(np.array_equal(again.arrays[name], array) for name, array in scene.arrays.items())
    for damaged in (b"", packed(scene)[:-400], b"meltemi scene 9\n" + packed(scene)[16:]):
        with pytest.raises(InputError, match="scene of the view is damaged"):
            unpacked(damaged)


def test_ten_minutes_take_at_most_three_megabytes(seen: Result, scene: Scene) -> None:
    """By the bytes of a second; those of turbulence have twice as many directions of the air forces."""
    plots = [view._plot(title, names, {"": seen}) for title, names in view.PLOTS.items()]
    full = view.with_plots(scene, seen, [plot for plot in plots if plot])
    assert full.arrays["plot.amplitude"].shape[1] == 11
    of_time = sum(a.nbytes for n, a in full.arrays.items() if n.endswith(".amplitude") or n == "azimuth")
    of_time += full.arrays["air.amplitude"].nbytes + full.arrays["wind.amplitude"].nbytes // 8
    fixed = len(packed(full)) - of_time
    assert (600.0 / DURATION * of_time + fixed) * 4 / 3 < 3e6
    assert {a.dtype.itemsize for n, a in full.arrays.items() if n.endswith(".amplitude")} == {1, 2}


def test_tracks_keep_their_tolerance() -> None:
    rng = np.random.default_rng(1)
    values = np.einsum("tk,kpn->tpn", rng.normal(size=(200, 4)), rng.normal(size=(4, 9, 2)))[:, None]
    values = values + 1e-4 * rng.normal(size=values.shape)
    for tolerance, directions in ((1e-2, 4), (1e-3, 4), (1e-4, 18)):
        arrays = track_arrays("x", values, tolerance)
        resolution = 18 * 10.0 / 32767  # of the amplitudes
        assert np.abs(Scene({}, arrays).track("x") - values).max() < tolerance + resolution
        assert len(arrays["x.scale"]) <= directions
    assert np.abs(Scene({}, track_arrays("x", values)).track("x") - values).max() < 1e-3


@pytest.mark.slow
def test_modes_move_what_they_are_named_after(model: Model) -> None:
    diagram = campbell(model, rotor_speeds=[0.0, 1.2], air=False)
    found = modes_scene(model, diagram)
    names = [mode["label"] for mode in found.about["points"][1]["modes"]]
    M, basis, tower = 4, found.arrays["basis"], found.arrays["tower_shape"]
    for label, column in (("1st tower fore-aft", 0), ("1st tower side-side", 1)):
        shape = found.arrays["shapes"][1, names.index(label)] @ [1.0, 1.0j]
        top = np.abs(shape[:M] @ tower[:, -1, :3])
        assert np.argmax(top) == column
        assert top.max() > 0.3
    flap = found.arrays["shapes"][1, names.index("1st flap collective")] @ [1.0, 1.0j]
    tip = np.abs(flap[M + 3 :: 3] @ basis[1, :, -1, :3])
    assert 0.9 < tip[0] <= 1.001
    assert tip[0] > 3.0 * tip[1]
    assert "modes in vacuum" in view.modes_view(model, diagram).html


# ---------------------------------------------------------------- in a browser

FRAMES = 10
"""Drawn before the page reports."""
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="needs chromium or google-chrome")
REPORT = """
<script>
const waiting = setInterval(() => {
  if (!window.view || view.frames < %d || (window.ready && !ready())) return;
  clearInterval(waiting);
  const told = { frames: view.frames, first: view.first - view.began, errors: faults, saved: window.saved };
  const { state, camera, renderer, root } = view;
  told.theme = root.dataset.theme;
  Object.assign(state, { playing: false, t: %f, wind: "off", factor: 1 });
  view.render();
  told.tips = view.tips();
  told.seen = told.tips.map((tips) => tips.map((tip) => new THREE.Vector3(...tip).project(camera).toArray()));
  told.picture = renderer.domElement.toDataURL();
  told.plots = root.querySelectorAll(".plot").length;
  fetch("told", { method: "POST", body: JSON.stringify(told) });
}, 50);
</script>
"""
FAULTS = '<script>const faults = []; addEventListener("error", (e) => faults.push(String(e.message)));</script>'


WIDGET = """<!DOCTYPE html><body><div id="cell" style="color: white"></div><script type="module">
%s
const values = %s, on = {}, bytes = Uint8Array.from(atob("%s"), (letter) => letter.charCodeAt(0));
values.scenes = [new DataView(bytes.buffer)];
const model = {
  get: (name) => values[name], off() {}, on(name, react) { on[name] = react; },
  set(name, value) { values[name] = value; on["change:" + name]?.(); },
  save_changes() {
    saved.push({ ...values, scenes: 0 });
    if (saved.length === 1) setTimeout(() => model.set("time", 5.0));
  },
};
Object.assign(window, { THREE, saved: [], ready: () => saved.length > 3 });
notebookWidget.render({ model, el: document.getElementById("cell") });
window.view = document.querySelector("#cell > div").view;
</script></body>"""


def browse(page: Any, folder: Path, now: float = NOW) -> dict[str, Any]:
    """What a page reports from a browser without screen when it has drawn some frames, at ``now`` [s]."""
    text = (
        page.html.replace("<body>", "<body>" + FAULTS).replace("</body>", REPORT % (FRAMES, now) + "</body>").encode()
    )
    told: Queue[bytes] = Queue()

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200 if self.path == "/page" else 404)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(text if self.path == "/page" else b"")

        def do_POST(self) -> None:
            content = self.rfile.read(int(self.headers["Content-Length"]))
            self.send_response(204)
            self.end_headers()
            told.put(content)

        def log_message(self, *_: Any) -> None: ...

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        command = [
            *(str(BROWSER), "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
            *(
                "--no-first-run",
                "--disable-extensions",
                "--window-size=700,480",
                f"--user-data-dir={folder / 'profile'}",
            ),
            f"http://127.0.0.1:{server.server_port}/page",
        ]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as browser:
            try:
                found: dict[str, Any] = json.loads(told.get(timeout=60.0))
            finally:
                browser.terminate()
                server.shutdown()
    assert found["errors"] == []
    return found


def pixels(found: dict[str, Any]) -> Any:
    """(rows, columns, 4) picture of the canvas."""
    import matplotlib.image

    return matplotlib.image.imread(BytesIO(base64.b64decode(found["picture"].split(",")[1])))


@pytest.mark.slow
@needs_browser
def test_a_browser_draws_the_tips_where_the_simulation_has_them(seen: Result, model: Model, tmp_path: Path) -> None:
    page = view.result_view({"run": seen}, look=view.Look("light"))
    assert "http" not in re.sub(r"<script>.*|http://www\.w3\.org/\S+", "", page.html, flags=re.DOTALL)
    found = browse(page, tmp_path)
    assert found["frames"] >= FRAMES
    assert found["plots"] == sum(any(name in seen for name in names) for names in view.PLOTS.values()) == 7  # no sea
    # the simulation's own kinematics, at the sample of this instant
    row = round(NOW / 0.05)
    case = Case(model, SteadyWind(speed=10.0))
    for i, name in enumerate(model.coordinates):
        case["q"][i] = seen["nacelle_yaw" if name == "yaw" else f"q {name}"][row]
    case.view("pitch")["angle"] = [seen[f"pitch_{b}"][row] for b in (1, 2, 3)]
    case.evaluate(0.0)
    hub, frames = case.view("machine")["hub_position"], View(BladeFrame, case["frame"])["orientation"]
    rest = np.array([0.0, 0.0, model.turbine.rotor_radius])
    picture = pixels(found)
    for b in range(3):
        deflection = [seen[f"tip_{name}_{b + 1}"][row] for name in ("flap", "edge", "axial")]
        expected = hub + frames[:, b].reshape(3, 3) @ (rest + deflection)
        assert np.abs(np.array(found["tips"][0][b]) - expected).max() < 0.03
        # the tip is drawn there, in its colour: blue, orange, purple
        x, y, _ = found["seen"][0][b]
        at = (round((0.5 - 0.5 * y) * picture.shape[0]), round((0.5 + 0.5 * x) * picture.shape[1]))
        near = picture[at[0] - 9 : at[0] + 10, at[1] - 9 : at[1] + 10]
        red, green, blue = (
            np.median(near[near[..., 3] > 0.9][:, :3], axis=0) if (near[..., 3] > 0.9).any() else (0, 0, 0)
        )
        assert ((blue > 1.3 * red), (red > 1.3 * blue), (red > 1.2 * green and blue > green))[b]
    drawn = (picture[..., 3] > 0.9).mean()
    assert 0.01 < drawn < 0.2


PLACES = """<!DOCTYPE html><body><script>
const places = {}, page = { height: 900, srcdoc: %s };
const frames = [390, 800, 1440].map((width) => Object.assign(document.createElement("iframe"), { width }, page));
frames.forEach((frame) => {
  frame.onload = () => {
    const boxes = ["stage", "plots", "time"].map((id) => frame.contentDocument.getElementById(id).getClientRects()[0]);
    places[frame.width] = boxes.map(({ x, width }) => [x, width]);
    if (Object.keys(places).length === frames.length) document.body.innerHTML = `<pre>${JSON.stringify(places)}</pre>`;
  };
  document.body.append(frame);
});
</script></body>"""


@pytest.mark.slow
@needs_browser
def test_on_a_phone_the_picture_has_the_whole_width(seen: Result, tmp_path: Path) -> None:
    bare = re.sub("<script.*</script>", "", seen.view().html, flags=re.DOTALL)
    bare = bare.replace('aria-label="Plots">', 'aria-label="Plots"><figure class="plot"></figure>')
    file = tmp_path / "places.html"
    file.write_text(PLACES % json.dumps(bare).replace("</", "<\\/"), "utf-8")
    how = ("--headless=new", "--no-sandbox", "--disable-gpu", "--dump-dom", f"--user-data-dir={tmp_path / 'profile'}")
    made = subprocess.run([str(BROWSER), *how, file.as_uri()], capture_output=True, text=True, timeout=60.0, check=True)
    places = json.loads(made.stdout.split("<pre>")[1].split("</pre>")[0])
    assert places["390"] == [[0, 390]] * 3
    for width, column in ((800, 15.5 * 16), (1440, 24 * 16)):
        assert places[str(width)] == [[0, width - column], [width - column, column], [0, width]]


def test_the_scripts_are_short() -> None:
    own = [file for file in Path(viewer.__file__).parent.glob("*.js") if file.name != "three.min.js"]
    assert sum(len(file.read_text("utf-8").splitlines()) for file in own) < 1650


@pytest.mark.long
@needs_browser
def test_a_widget_draws_the_same_and_shares_its_time(seen: Result, tmp_path: Path) -> None:
    widget = pytest.importorskip("meltemi.view.widget")
    made = seen.view(look=view.Look(begin=1.0)).widget
    values = json.dumps(
        {name: getattr(made, name) for name in ("spec", "content", "style", "licence", "time", "playing")}
    )
    scene = base64.b64encode(made.scenes[0]).decode()
    code = viewer.script("widget").replace("export default", "const notebookWidget =")
    assert isinstance(made, widget.ViewWidget)
    found = browse(SimpleNamespace(html=WIDGET % (code, values, scene)), tmp_path)
    assert found["plots"] == sum(any(name in seen for name in names) for names in view.PLOTS.values()) == 7  # no sea
    assert found["theme"] == "dark"  # light text around it
    times = [told["time"] for told in found["saved"]]
    assert 1.0 <= times[0] < 4.5  # where it begins; then Python has set five seconds
    assert all(5.0 <= time <= DURATION or time < times[0] for time in times[1:])
    assert max(times) >= 5.0


@needs_browser
@pytest.mark.long
def test_a_browser_draws_pairs_modes_and_winds(seen: Result, model: Model, tmp_path: Path) -> None:
    pages = {
        "pair": view.result_view({"a": seen, "b": replace(seen)}, look=view.Look(state={"pairs": "over"})),
        "modes": view.modes_view(model, campbell(model, rotor_speeds=[0.0, 1.2], air=False)),
        "wind": view.wind_view(SteadyWind(speed=9.0, shear_exponent=0.2)),
        "loads": view.result_view({"a": seen}, look=view.Look("dark", state={"loads": "arrows"})),
    }
    found = {}
    for name, page in pages.items():
        (tmp_path / name).mkdir()
        found[name] = browse(page, tmp_path / name)
        assert found[name]["frames"] >= FRAMES
    assert len(found["pair"]["tips"]) == 2
    assert np.allclose(found["pair"]["tips"][0], found["pair"]["tips"][1])
    assert found["loads"]["theme"] == "dark"
    assert found["wind"]["tips"] == []
    assert np.ptp(found["modes"]["tips"]) > 50.0
