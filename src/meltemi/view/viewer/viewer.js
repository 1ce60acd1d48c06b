"use strict";
// The view in an element of class "view" that holds page.html: the picture, its controls, and the clock that drives both.
// ``keys`` is where the keyboard is heard. The functions below share what is drawn; they are not indented.
function mountView(root, { spec, scenes, licence }, keys) {

const began = performance.now(), ended = new AbortController(), until = { signal: ended.signal };
const find = (id) => root.querySelector(`#${id}`), all = (selector) => root.querySelectorAll(selector);
const SPEEDS = spec.live ? liveSpeeds(spec.state.speed) : [0.1, 0.25, 0.5, 1, 2, 5, 10, 20];
const state = { t: 0, playing: true, speed: 1, factor: 1, wind: "rotor", vortices: "on", loads: "off", camera: "corner", pairs: "beside", window: Infinity, dirty: true };
const view = { root, frames: 0, first: 0, began, state, scenes, tips: () => turbines.map((each) => each.view.tips()) };

// ---------------------------------------------------------------- theme
function setTheme(name) {
  root.dataset.theme = name;
  state.dirty = state.redraw = true;
  if (renderer) paintWorld();
}
function paintWorld() {
  const dark = root.dataset.theme === "dark";
  grid.material.color.set(dark ? "#9fc4da" : "#2c4656");
  shade.material.opacity = dark ? 0.4 : 0.24;
  sky.intensity = dark ? 1.1 : 1.75;
  sun.intensity = dark ? 1.9 : 2.6;
}
const system = matchMedia("(prefers-color-scheme: dark)");
system.addEventListener("change", (event) => setTheme(event.matches ? "dark" : "light"), until);

// ---------------------------------------------------------------- renderer, light, ground
const stage = find("stage");
let renderer;
setTheme(spec.theme || (system.matches ? "dark" : "light"));
try {
  renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
} catch {
  stage.insertAdjacentHTML("beforeend", '<p id="fault">This browser does not draw in three dimensions (WebGL is missing or off).</p>');
  return view;
}
renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
renderer.shadowMap.enabled = true;
renderer.shadowMap.type = THREE.PCFShadowMap;
renderer.toneMapping = THREE.ACESFilmicToneMapping;
stage.prepend(renderer.domElement);
renderer.domElement.tabIndex = 0;
renderer.domElement.setAttribute("aria-label", "The turbine in three dimensions");

const kind = scenes[0].about.kind, alone = kind === "wind", modes = kind === "modes";
const first = scenes[0].about, largest = (key) => Math.max(...scenes.map(({ about }) => about.turbine[key]));
const size = alone ? first.wind.half_width : largest("rotor_radius");
const farm = alone || modes ? null : first.farm, pair = scenes.length > 1 && !farm, [farX, farY] = farm ? farm.half : [0, 0];
const vast = Math.max(1, farX / (4 * size), farY / (4 * size)); // how much larger than around one turbine
const hub = alone ? first.wind.height : largest("hub_height"), high = hub + (alone ? first.wind.half_height : size);

const world = new THREE.Scene(), camera = new THREE.PerspectiveCamera(32, 1, 0.02 * size, 60 * vast * size);
camera.up.set(0, 0, 1);
const orbit = new THREE.OrbitControls(camera, renderer.domElement);
orbit.enableDamping = true;
orbit.maxPolarAngle = 0.495 * Math.PI;
orbit.minDistance = 0.15 * size;
orbit.maxDistance = 25 * vast * size;
orbit.addEventListener("change", () => { state.dirty = true; });
orbit.addEventListener("start", () => { if (state.camera !== "blade") state.camera = ""; press(); });
const sky = new THREE.HemisphereLight("#ffffff", "#8d9a8c", 1.7), sun = new THREE.DirectionalLight("#fff4e2", 2.4);
sun.position.set(-2.2 * vast * size, -2.6 * vast * size, hub + 2.6 * vast * size);
sun.target.position.set(0, 0, 0.5 * hub);
sun.castShadow = true;
sun.shadow.mapSize.set(2048, 2048);
const reach = farm ? Math.hypot(farX, farY) : (pair ? 3.4 : 2.1) * size;
Object.assign(sun.shadow.camera, { left: -reach, right: reach, bottom: -reach, top: reach, near: 0.1 * size, far: 14 * vast * size });
sun.shadow.normalBias = 0.004 * size;
world.add(sky, sun, sun.target);

const shade = new THREE.Mesh(new THREE.CircleGeometry(14 * size, 64), new THREE.ShadowMaterial({ opacity: 0.22 }));
shade.receiveShadow = true;
world.add(shade);
const lines = [], fade = [];
for (let r = 1; r <= 12; r++) { // rings of half a rotor diameter, and rays
  for (let i = 0; i < 128; i++) for (const j of [i, i + 1]) lines.push(r * size * Math.cos((Math.PI * j) / 64), r * size * Math.sin((Math.PI * j) / 64), 0) && fade.push(1 - r / 12.5);
}
for (let i = 0; i < 24; i++) for (let r = 1; r < 12; r++) for (const s of [r, r + 1]) lines.push(s * size * Math.cos((Math.PI * i) / 12), s * size * Math.sin((Math.PI * i) / 12), 0) && fade.push(1 - s / 12.5);
const ground = new THREE.BufferGeometry();
ground.setAttribute("position", new THREE.BufferAttribute(new Float32Array(lines), 3));
ground.setAttribute("color", new THREE.BufferAttribute(new Float32Array(fade.flatMap((a) => [1, 1, 1, 0.55 * a * a])), 4));
const grid = new THREE.LineSegments(ground, new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }));
grid.position.z = 0.002 * size;
grid.scale.setScalar(vast);
shade.scale.setScalar(vast);
world.add(grid);

const sea = !alone && first.turbine.water ? new SeaView(scenes[0], size) : null;
shade.visible = grid.visible = !sea;
if (sea) world.add(sea.mesh);
// ---------------------------------------------------------------- turbines and winds
const turbines = alone ? [] : scenes.map((scene, i) => {
  const tips = pair ? Array(9).fill(spec.colours[i]) : spec.colours;
  const body = new TurbineView(scene, { body: pair && i ? "#f3e3cb" : "#f1f3f4", tips, opacity: 1 });
  body.shadows(body.group);
  if (farm) body.group.position.set(scene.about.place[0] - farm.centre[0], scene.about.place[1] - farm.centre[1], 0);
  world.add(body.group);
  return { view: body, motion: modes ? new ModeMotion(scene) : new RunMotion(scene), pose: null };
});
const winds = modes || farm ? [] : scenes.map((scene) => new WindView(scene));
const vortices = turbines.filter((_, i) => scenes[i].about.vortices).map(({ view: { scene, group } }) => {
  const lines = new VortexView(scene);
  group.add(lines.mesh);
  return lines;
});
const wakes = first.wakes ? new WakeRings(scenes[0], farm.centre) : null;
if (wakes) world.add(wakes.mesh);
const extremes = [Math.min(...winds.map((wind) => wind.range[0])), Math.max(...winds.map((wind) => wind.range[1]))];
winds.forEach((wind) => {
  wind.range = extremes;
  world.add(wind.group);
});
if (alone) [...find("wind").options].forEach((option, i) => { option.text = ["standing", "travelling", "off"][i]; });
const duration = alone ? first.duration : Math.max(...turbines.map((each) => each.motion.duration));
/** What time does: that of a recorded scene ends and begins again. */
const clock = spec.live ? new LiveClock(Object.assign(view, { spec, find, turbines, winds, sea, extremes, legends })) : {
  begin: first.begin || 0,
  window: () => { const long = state.window < duration, end = long ? Math.max(state.t, state.window) : duration; return [long ? end - state.window : 0, end]; },
  now: () => state.t,
  text() { return `${(this.begin + state.t).toFixed(1)} / ${(this.begin + duration).toFixed(0)} s`; },
  advance(past) {
    state.t += past * state.speed;
    if (state.t >= duration) state.t = 0;
  },
};
const { begin } = clock;
state.t = Math.min(Math.max((spec.begin || 0) - begin, 0), duration);

/** Places of two turbines: beside each other across the wind, or the second one see-through in the first. */
function arrange() {
  if (!pair) return;
  const apart = state.pairs === "beside" ? 1.25 * size : 0;
  [...turbines.map((each) => each.view), ...winds].forEach((each, i) => { each.group.position.y = apart * (1 - 2 * (i % 2)); });
  winds[1].hidden = !apart;
  turbines[1].view.group.traverse((part) => {
    if (!part.isMesh || part.isInstancedMesh) return;
    part.material.transparent = !apart;
    part.material.opacity = apart ? 1 : 0.55;
    part.material.needsUpdate = true;
  });
}

// ---------------------------------------------------------------- cameras
const CAMERAS = {
  corner: ["Corner", [-0.86, -0.5, 0.1]], front: ["Front", [-1, 0, 0.02]], side: ["Side", [0, -1, 0.02]],
  above: ["Above", [-0.02, 0, 1]], rear: ["Rear", [0.8, 0.6, 0.22]], blade: ["Blade", null],
};
function look(name) {
  state.camera = name;
  press();
  const box = stage.getBoundingClientRect();
  camera.aspect = box.width / Math.max(box.height, 1);
  orbit.enabled = name !== "blade";
  camera.fov = name === "blade" ? 55 : 32;
  camera.updateProjectionMatrix();
  state.dirty = true;
  if (name === "blade" || !name) return;
  const direction = new THREE.Vector3(...(farm && name === "above" ? [0, -0.02, 1] : CAMERAS[name][1])).normalize(), spread = pair && state.pairs === "beside" ? 1.25 * size : 0;
  const trail = vortices.length && !/front|rear/.test(name) ? 4 * size : 0; // of the wake, downwind
  const spans = (x, y) => (Math.abs(farX * x) + Math.abs(farY * y)) / Math.hypot(direction.x, direction.y);
  const tall = (name === "above" ? 2.3 * size + 2.3 * farY + trail : 1.2 * high) / (1 + 2 * (camera.view ? camera.view.offsetY / camera.view.fullHeight : 0));
  const across = 2.25 * size + (name === "side" ? 0 : 2.8 * spread) + 2.3 * spans(direction.y, direction.x) + trail * Math.abs(direction.y);
  const half = Math.tan((camera.fov * Math.PI) / 360);
  const away = (alone ? 1.2 : 1) * Math.max(tall / 2 / half, across / 2 / half / camera.aspect) + (name === "side" ? 1.6 * spread : 0.35 * size) + (name === "above" ? 0 : 0.7 * spans(direction.x, direction.y));
  orbit.target.set((name === "corner" ? 0.3 : 0.5) * trail, 0, name === "above" ? hub : 0.515 * high);
  camera.position.copy(orbit.target).addScaledVector(direction, away);
  orbit.update();
}
/** Camera that turns with blade 1, at its root, and looks along it. */
function follow() {
  const { pitched } = turbines[0].view.frames[0], R = first.turbine.rotor_radius;
  pitched.updateWorldMatrix(true, false);
  const at = (x, y, z) => new THREE.Vector3(x, y, z).applyMatrix4(pitched.parent.matrixWorld);
  camera.position.copy(at(-0.1 * R, -0.02 * R, -0.02 * R));
  camera.up.copy(at(-1, 0, 0).sub(at(0, 0, 0)));
  camera.lookAt(at(0, 0, 0.75 * R));
  camera.up.set(0, 0, 1);
}

// ---------------------------------------------------------------- controls
const text = (id, value) => { find(id).closest("label").querySelector("output").textContent = value; };
function press() {
  all(".cameras button").forEach((button) => button.setAttribute("aria-pressed", button.dataset.camera === state.camera));
}
function build() {
  root.querySelector("h1").textContent = spec.title;
  root.querySelector("header .about").textContent = spec.subtitle.replace(/(\d|seed|exponent) (?=[^,])/g, "$1\u00a0"); // numbers stay with their units
  if (scenes.length > 1) root.querySelector(".key").append(...spec.names.map((name, i) => Object.assign(document.createElement("span"), { innerHTML: `<i style="background:var(--c${i})"></i>`, title: name })));
  all(".key span").forEach((each) => each.append(each.title));
  find("help").querySelector(".words").textContent = spec.words;
  find("help").querySelector("pre").textContent = licence;
  const has = { modes, wakes, vortices: vortices.length > 0, shapes: !alone && !modes, plots: plots.length > 0 && (spec.live || duration > 30), pairs: pair, wind: winds.length > 0, loads: kind === "run" };
  for (const [name, yes] of Object.entries(has)) all(`.of-${name}`).forEach((each) => { each.hidden = !yes; });
  const names = Object.keys(CAMERAS).filter((name) => turbines.length || name !== "blade");
  find("settings").querySelector(".cameras").append(...names.map((name, i) => {
    const button = Object.assign(document.createElement("button"), { textContent: CAMERAS[name][0], title: `Key ${i + 1}`, onclick: () => look(name) });
    button.dataset.camera = name;
    return button;
  }));
  find("speed").append(...SPEEDS.map((x) => new Option(`×${x}`, x, x === state.speed, x === state.speed)));
  const bind = (id, change) => { find(id).oninput = (event) => { change(event.target.value); state.dirty = true; }; };
  bind("factor", setFactor);
  bind("wind", (value) => { state.wind = value; legends(); });
  bind("vortices", (value) => { state.vortices = value; });
  bind("loads", (value) => { state.loads = value; legends(); });
  bind("window", (value) => { state.window = Number(value) || Infinity; state.redraw = true; });
  bind("speed", (value) => { state.speed = Number(value); });
  bind("pairs", (value) => { state.pairs = value; arrange(); look(state.camera || "corner"); });
  bind("seek", (value) => { state.t = Number(value); state.playing = false; });
  find("seek").max = Number.isFinite(duration) ? duration : 1;
  find("play").onclick = () => { state.playing = !state.playing; state.dirty = true; };
  find("picture").onclick = picture;
  find("theme").onclick = () => setTheme(root.dataset.theme === "dark" ? "light" : "dark");
  find("ask").onclick = () => { find("help").hidden = !find("help").hidden; };
  if (root.clientWidth <= 960) find("settings").open = false;
  for (const name of ["wind", "vortices", "loads", "pairs"]) find(name).value = state[name];
  find("window").value = Number.isFinite(state.window) ? state.window : "";
  if (modes) buildModes(bind);
  setFactor(state.factor);
}
function setFactor(value) {
  state.factor = Number(value);
  find("factor").value = value;
  text("factor", `×${state.factor}`);
}
function buildModes(bind) {
  const { motion } = turbines[0], points = first.points;
  find("point").append(...points.map((p, i) => new Option(p.name, i)));
  const list = () => {
    find("mode").replaceChildren(...points[motion.point].modes.map((m, i) => new Option(`${m.label}, ${short(m.frequency / 2 / Math.PI)} Hz`, i)).filter((_, i) => points[motion.point].modes[i].frequency));
    const kept = [...find("mode").options].find((option) => Number(option.value) === motion.mode) || find("mode").options[0];
    kept.selected = true;
    motion.mode = Number(kept.value);
    tell();
  };
  const tell = () => {
    const m = points[motion.point].modes[motion.mode];
    root.querySelector(".about").textContent = `${points[motion.point].name}: ${m.label}, ${short(m.frequency / 2 / Math.PI)} Hz, damping ${short(100 * m.damping)} %`;
  };
  bind("point", (value) => { motion.point = Number(value); list(); });
  bind("mode", (value) => { motion.mode = Number(value); tell(); });
  bind("turning", (value) => { motion.turning = Boolean(value); });
  const amplify = (value) => { motion.amplitude = value * size; text("amplitude", `${short(motion.amplitude)} m`); };
  bind("amplitude", amplify);
  amplify(0.05);
  motion.point = Math.floor(points.length / 2);
  find("point").selectedIndex = motion.point;
  list();
  find("seek").style.visibility = "hidden";
}
const bar = (colours) => `<div style="background:linear-gradient(90deg,${colours.join(",")})"></div>`;
function legends() {
  if (winds.length) {
    const [low, most] = extremes;
    find("wind-legend").innerHTML = `${bar(WIND_COLOURS)}<p><span>${short(low)}</span><span>along the wind, m/s</span><span>${short(most)}</span></p>`;
    find("wind-legend").hidden = state.wind === "off";
  }
  if (wakes) find("wake-legend").innerHTML = `${bar(DEFICIT_COLOURS)}<p><span>0</span><span>deficit of the wakes, m/s</span><span>${short(wakes.largest)}</span></p>`;
  if (vortices.length) {
    const most = short(Math.max(...vortices.map((lines) => lines.largest)));
    find("vortex-legend").innerHTML = `${bar(VORTEX_COLOURS)}<p><span>−${most}</span><span>roots, tips: strength, m²/s</span><span>${most}</span></p>`;
  }
  if (kind !== "run") return;
  const { largest } = first, mega = (x) => `${short(x / 1e6)}`;
  find("load-legend").hidden = state.loads === "off";
  find("load-legend").innerHTML = state.loads === "colours"
    ? `${bar(LOAD_COLOURS)}<p><span>0</span><span>blades, MN m</span><span>${mega(largest.bending)}</span></p><p><span>0</span><span>tower, MN m</span><span>${mega(largest.tower_bending)}</span></p>`
    : `<p><span>Blue: air forces, longest ${short(largest.air / 1e3)} kN/m</span></p><p><span>Purple: moments at roots and base, towards the side to which they bend; longest ${mega(largest.bending)} and ${mega(largest.tower_bending)} MN m</span></p>`;
}

// ---------------------------------------------------------------- plots
if (farm) scenes.forEach((_, i) => i > 2 && root.style.setProperty(`--c${i}`, `hsl(${(137 * i) % 360} 55% 48%)`));
const plots = (first.plots || []).map((plot) => new Plot(find("plots"), {
  title: plot.title,
  unit: plot.unit,
  zero: spec.live ? 0 : begin,
  lines: scenes.flatMap((scene, i) => {
    const own = scene.about.plots.find((other) => other.title === plot.title);
    const chosen = own ? (scenes.length > 1 ? own.lines.slice(0, 1) : own.lines) : [];
    const series = chosen.length && (spec.live ? clock.series : recordedSeries(scene));
    return chosen.map((line, k) => plotLine(series, line.column, { name: line.name, colour: `--c${scenes.length > 1 ? i : k}` }));
  }),
}, (t) => { if (!spec.live) Object.assign(state, { t, playing: false, dirty: true }); }));
if (!plots.length) root.classList.add("bare");
function drawPlots() {
  plots.forEach((plot) => plot.draw(...clock.window()));
}

// ---------------------------------------------------------------- picture
function picture() {
  render();
  const from = renderer.domElement, to = document.createElement("canvas"), pen = to.getContext("2d"), style = getComputedStyle(stage);
  [to.width, to.height] = [from.width, from.height];
  const level = horizon() * to.height, paint = pen.createLinearGradient(0, level - 0.9 * to.height, 0, level + 0.5 * to.height);
  [["sky-top", -0.9], ["sky-low", -0.12], ["haze", 0], ["ground", 0.01], ["near", 0.5]].forEach(([name, at]) => paint.addColorStop((at + 0.9) / 1.4, style.getPropertyValue(`--${name}`)));
  pen.fillStyle = paint;
  pen.fillRect(0, 0, to.width, to.height);
  pen.drawImage(from, 0, 0);
  const em = Math.max(16, to.width / 70);
  pen.fillStyle = style.getPropertyValue("--ink");
  pen.font = `600 ${em}px system-ui, sans-serif`;
  pen.fillText(spec.title, em, 1.8 * em);
  pen.font = `${0.8 * em}px system-ui, sans-serif`;
  pen.fillText(root.querySelector(".about").textContent + (modes ? "" : `, ${(clock.begin + state.t).toFixed(2)} s`), em, 3.1 * em);
  to.toBlob((blob) => {
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `${spec.title.toLowerCase().replace(/[^\w]+/g, "-")}.png` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
}

// ---------------------------------------------------------------- keyboard
const step = (list, now, by) => list[Math.min(Math.max(list.indexOf(now) + by, 0), list.length - 1)];
function choose(id, by) {
  const select = find(id);
  select.selectedIndex = (select.selectedIndex + by + select.options.length) % select.options.length;
  select.dispatchEvent(new Event("input"));
}
const seekBy = (x) => { if (spec.live) return; state.playing = false; state.t = Math.min(Math.max(state.t + x, 0), duration); };
const faster = (by) => { state.speed = step(SPEEDS, state.speed, by); find("speed").value = state.speed; };
const KEYS = {
  " ": () => find("play").click(), ArrowLeft: (e) => seekBy(e.shiftKey ? -5 : -0.1), ArrowRight: (e) => seekBy(e.shiftKey ? 5 : 0.1),
  ArrowUp: () => faster(1), ArrowDown: () => faster(-1), "+": () => setFactor(Math.min(state.factor + 1, 10)), "-": () => setFactor(Math.max(state.factor - 1, 0)),
  w: () => choose("wind", 1), l: () => choose("loads", 1), p: picture, d: () => find("theme").click(), h: () => find("ask").click(),
  z: () => choose("window", 1), Escape: () => { find("help").hidden = true; },
};
keys.addEventListener("keydown", (event) => {
  const [{ tagName, type, id }] = event.composedPath(); // the target, of a widget, too
  if (event.ctrlKey || event.metaKey || event.altKey || /^(SELECT|SUMMARY)$/.test(tagName) || (type === "range" && id !== "seek" && event.key.startsWith("Arrow")) || (tagName === "BUTTON" && event.key === " ")) return;
  const names = Object.keys(CAMERAS), action = /^[1-6]$/.test(event.key) ? () => (turbines.length || event.key !== "6") && look(names[event.key - 1]) : KEYS[event.key];
  if (!action) return;
  event.preventDefault();
  event.stopPropagation();
  action(event);
  state.dirty = true;
}, until);

// ---------------------------------------------------------------- clock
/** Place of the horizon on the picture, from its top, as a share of the height. */
function horizon() {
  const down = -camera.getWorldDirection(new THREE.Vector3()).z, slope = down / Math.sqrt(Math.max(1 - down * down, 1e-6));
  return 0.5 - (0.5 * slope) / Math.tan((camera.fov * Math.PI) / 360) - (camera.view ? camera.view.offsetY / camera.view.fullHeight : 0);
}
function render() {
  const { t, factor } = state;
  turbines.forEach((each) => {
    each.pose = each.motion.at(Math.min(t, each.motion.duration));
    each.view.update(each.pose, modes ? 1 : factor);
    each.view.showLoads(Math.min(t, each.motion.duration), state.loads, each.pose, factor);
  });
  winds.forEach((wind) => wind.update(t, wind.hidden ? "off" : state.wind));
  sea?.update(t);
  wakes?.update(begin + t);
  vortices.forEach((lines) => { if ((lines.mesh.visible = state.vortices === "on" && t > lines.begin - lines.step)) lines.update(t); });
  if (state.camera === "blade") follow();
  stage.style.setProperty("--horizon", `${(100 * horizon()).toFixed(1)}%`);
  renderer.render(world, camera);
}
function resize() {
  const box = stage.getBoundingClientRect();
  if (box.width === resize.width && box.height === resize.height) return;
  [resize.width, resize.height] = [box.width, box.height];
  renderer.setSize(box.width, box.height, false);
  const wide = box.width > 700, aside = wide && find("settings").open ? -0.07 * box.width : 0; // of the panel
  const under = wide ? 0 : -0.5 * root.querySelector("header").offsetHeight; // the text above
  camera.setViewOffset(box.width, box.height, aside, under, box.width, box.height);
  camera.aspect = box.width / Math.max(box.height, 1);
  camera.updateProjectionMatrix();
  if (state.camera) look(state.camera);
  state.dirty = state.redraw = true;
  render(); // at once: the new size has cleared the picture
}
let last = 0, slow = 0;
function frame(now) {
  if (ended.signal.aborted) return;
  requestAnimationFrame(frame);
  const past = Math.min((now - last) / 1000, 0.25);
  last = now;
  if (state.playing) {
    clock.advance(past);
    state.dirty = true;
    // a slow computer draws no shadows, then fewer points
    slow = past > 1 / 24 ? slow + 24 * past : Math.max(slow - 1, 0);
    if (slow > 40 && sun.castShadow) { sun.castShadow = false; slow = 0; }
    else if (slow > 40 && renderer.getPixelRatio() > 1) { renderer.setPixelRatio(1); slow = 0; }
  }
  if (state.camera !== "blade") orbit.update();
  if (state.redraw || (state.dirty && state.window < duration)) drawPlots();
  state.redraw = false;
  if (!state.dirty) return;
  state.dirty = false;
  render();
  find("seek").value = state.t;
  find("play").setAttribute("aria-pressed", state.playing);
  find("time").querySelector("output").textContent = modes ? "slow motion" : clock.text();
  plots.forEach((plot) => plot.at(clock.now()));
  view.frames += 1;
  view.first ||= performance.now();
}
if (vortices.length) state.wind = "off"; // the section would hide them
Object.assign(state, spec.state || {});
if (spec.live) clock.build(KEYS);
paintWorld();
build();
arrange();
legends();
resize();
const watching = [[resize, stage], [drawPlots, find("plots")]].map(([react, part]) => {
  const watch = new ResizeObserver(react);
  watch.observe(part);
  return watch;
});
find("settings").ontoggle = () => { resize.width = 0; resize(); };
if (matchMedia("(prefers-reduced-motion: reduce)").matches) state.playing = false;
if (spec.live) clock.connect();
frame(began);
const stop = () => {
  ended.abort();
  watching.forEach((watch) => watch.disconnect());
  renderer.dispose();
  renderer.forceContextLoss();
};
return Object.assign(view, { render, camera, renderer, begin, duration, setTheme, stop });
}
