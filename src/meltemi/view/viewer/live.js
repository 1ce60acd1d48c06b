"use strict";
// A scene that runs on: pieces of it from the socket in a queue, the clock that plays them, sliders and buttons.

const KEPT = 600, SHOWN = 60, AHEAD = 0.2; // [s] simulated in the plots' memory, and shown at real time; wall time of the queue
const liveSpeeds = (own) => [...new Set([0.25, 0.5, 1, 2, 5, 10, 20, own])].sort((a, b) => a - b);

/** The last samples of the channels of plots, by number from the start of the run. */
class RollingSeries {
  constructor(scene) {
    this.step = scene.about.steps.plot;
    this.room = Math.round(KEPT / this.step);
    this.columns = scene.arrays["plot.scale"].length;
    this.values = new Float32Array(this.room * this.columns);
    this.clear(0);
    this.add(scene);
  }

  clear(row) {
    this.begin = this.rows = row;
  }

  get first() {
    return Math.max(this.begin, this.rows - this.room);
  }

  value(i, column) {
    return this.values[(i % this.room) * this.columns + column];
  }

  add(scene) {
    const piece = recordedSeries(scene), at = Math.round(scene.about.begin / this.step);
    if (at > this.rows) this.clear(at);
    for (let i = 0; i < piece.rows; i++) {
      for (let c = 0; c < this.columns; c++) this.values[((at + i) % this.room) * this.columns + c] = piece.value(i, c);
    }
    this.rows = at + piece.rows;
  }
}

/** Time of the simulation, as the page plays it: some tenths of a second behind what has arrived. ``view`` is that of mountView. */
class LiveClock {
  constructor(view) {
    const { state, scenes, find, spec } = view, first = scenes[0].about;
    Object.assign(this, { view, state, first, find, live: spec.live, begin: first.begin, span: 0, run: first.run, queue: [], arrived: [], skipped: 0, ended: false, sent: "", drawn: [0, 0, 0] });
    this.series = new RollingSeries(scenes[0]);
    view.live = this;
  }

  now() {
    return this.begin + this.state.t;
  }

  window() {
    const { state } = this, long = Math.min(SHOWN * Math.max(state.speed, 1), KEPT) * (Number.isFinite(state.window) ? 0.5 : 1), end = Math.max((this.series.rows - 1) * this.series.step, long);
    return [end - long, end];
  }

  text() {
    return `${grouped(this.now().toFixed(1))} s`;
  }

  /** Play the queue: somewhat faster where it is long, slower where it is short; skip what is far too long. */
  advance(past) {
    const { state } = this, wall = () => (this.span - state.t + this.queue.reduce((sum, piece) => sum + piece.about.duration, 0)) / state.speed;
    const each = this.queue.length ? this.queue[0].about.duration / state.speed : 0.1, aim = AHEAD + 0.5 * each;
    while (wall() > 1 + 4 * each && this.queue.length > 1) {
      this.show(this.queue.shift());
      this.skipped += 1;
    }
    state.t += past * state.speed * Math.min(Math.max(1 + (0.5 * (wall() - aim)) / aim, 0.5), 1.5);
    while (state.t >= this.span && this.queue.length) {
      state.t -= this.span;
      this.show(this.queue.shift());
    }
    state.t = Math.min(state.t, this.span);
  }

  /** A piece takes the place of the one before. */
  show(piece) {
    const { first, view: { turbines: [turbine], winds, extremes, legends } } = this, { about } = piece, { pose } = turbine.motion;
    turbine.motion = Object.assign(new RunMotion({ about: { ...first, ...about }, arrays: piece.arrays }), { pose });
    turbine.view.take(piece);
    winds[0].take(piece);
    this.view.sea?.take(piece);
    this.begin = about.begin;
    this.span = about.duration;
    let larger = false;
    for (const [name, most] of Object.entries(about.largest)) {
      larger ||= most > 1.05 * first.largest[name];
      if (most > first.largest[name]) first.largest[name] = most;
    }
    const { speed, intensity } = about.wind, range = [Math.max(speed * (0.8 - 3 * intensity), 0), speed * (1.15 + 3 * intensity)].map(Math.round);
    if (larger || range.some((x, i) => x !== extremes[i])) {
      extremes.splice(0, 2, ...range);
      legends();
    }
  }

  // ---------------------------------------------------------------- socket
  connect() {
    const socket = (this.socket = new WebSocket(`${location.href.replace(/^http/, "ws").replace(/[?#].*/, "")}socket`));
    socket.binaryType = "arraybuffer";
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.hear(JSON.parse(data)) : this.take(readScene(new Uint8Array(data))));
    socket.onclose = ({ code }) => this.halt(code === 4000 ? "This simulation is open in another window." : "The simulation has ended; start meltemi live again.", false);
    this.tell();
    setInterval(() => this.tell(), 500);
    setInterval(() => this.send({}), 100);
  }

  /** Send a message; playing and speed go along whenever they have changed. */
  send(message) {
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    const how = JSON.stringify({ playing: this.state.playing, speed: this.state.speed });
    if (how !== this.sent) this.socket.send((this.sent = how));
    if (Object.keys(message).length) this.socket.send(JSON.stringify(message));
  }

  take(piece) {
    if (piece.about.run !== this.run) return;
    this.series.add(piece);
    this.queue.push(piece);
    if (this.queue.length > 100) this.skipped += this.queue.splice(0, 90).length; // of a page that nobody sees
    this.arrived.push([piece.about.sent, piece.about.begin + piece.about.duration]);
    this.latest = performance.now();
    if (this.arrived.length > 25) this.arrived.shift();
    this.state.redraw = true;
  }

  hear({ state: now, busy, error }) {
    if (busy) this.note(busy);
    if (error) this.note(error, true);
    if (!now) return;
    if (now.run !== this.run) {
      Object.assign(this, { run: now.run, queue: [], arrived: [] });
      this.series.clear(0);
      for (const name in this.first.largest) this.first.largest[name] = 0;
      this.note("");
    }
    this.follow(now);
  }

  // ---------------------------------------------------------------- controls
  build(keys) {
    const { find, view: { root } } = this, { sliders, controllers, faults, requests, state: now } = this.live, panel = document.createElement("section");
    root.classList.add("live");
    panel.id = "live";
    panel.setAttribute("aria-label", "Operation");
    const slider = ({ name, label, unit, low, high, step }) => `<label><span>${label}</span><output></output><input type="range" name="${name}" data-unit="${unit}" min="${low}" max="${high}" step="${step}" aria-label="${label}, ${unit}"></label>`;
    const button = (kind) => ([name, text]) => `<button data-${kind}="${name}">${text}</button>`;
    panel.innerHTML = `<h2>Wind and power</h2>${sliders.map(slider).join("")}
      <h2>Controller</h2><select name="controller" aria-label="Controller"></select><p class="about"></p>
      <div class="buttons">${Object.entries(requests).map(button("request")).join("")}</div>
      <h2>Faults</h2><div class="buttons">${Object.entries(faults).map(button("fault")).join("")}</div>
      <h2>Events and warnings</h2><ol aria-live="polite"></ol>`;
    panel.querySelector("select").append(...controllers.map(({ name }) => new Option(name))); // a name is text, not HTML
    root.insertBefore(panel, find("plots"));
    this.panel = panel;
    this.inputs = [...panel.querySelectorAll("input")];
    for (const input of this.inputs) {
      input.oninput = () => {
        input.touched = performance.now();
        this.label(input);
        this.send({ set: input.name, value: Number(input.value) });
      };
    }
    panel.querySelector("select").onchange = (event) => this.send({ controller: event.target.value });
    panel.onclick = ({ target: { dataset, ariaPressed } }) => {
      if (dataset.fault) this.send({ fault: dataset.fault, on: ariaPressed !== "true" });
      if (dataset.request) this.send({ request: dataset.request });
    };
    const reset = Object.assign(document.createElement("button"), { id: "reset", textContent: "Restart", title: "Begin again in steady operation, without faults (r)", onclick: () => this.send({ reset: true }) });
    find("play").after(reset, Object.assign(document.createElement("span"), { id: "status" }));
    keys.r = () => reset.click();
    const help = find("help").querySelector("dl");
    [...help.querySelectorAll("dt")].find((each) => each.textContent.startsWith("←")).replaceWith(Object.assign(document.createElement("dt"), { textContent: "r" }));
    help.querySelectorAll("dd")[1].textContent = "restart";
    [...help.querySelectorAll("dd")].find((each) => each.textContent.startsWith("plots")).textContent = "plots: the last minute, or half of it";
    [find("window").options[0].text, find("window").options[1].text] = ["last minute", "half of it"];
    find("wind").querySelector("[value=travelling]").remove(); // it would need the wind of some seconds ahead
    find("settings").open = false;
    find("stage").insertAdjacentHTML("beforeend", '<div id="halt" role="alert" hidden><div><p></p><button>Restart</button></div></div>');
    find("halt").querySelector("button").onclick = () => reset.click();
    this.follow(now);
  }

  label(input) {
    const text = `${grouped(String(Number(input.value)))} ${input.dataset.unit}`;
    input.previousElementSibling.textContent = input.disabled ? "not followed" : text;
    input.setAttribute("aria-valuetext", text);
  }

  /** Show the state of the session. */
  follow(now) {
    const { panel } = this, chosen = this.live.controllers.find((each) => each.name === now.controller);
    for (const input of this.inputs) {
      input.disabled = input.name === "power_limit" && !now.operator;
      if (!(performance.now() - input.touched < 1000)) input.value = now.values[input.name];
      this.label(input);
    }
    panel.querySelector("select").value = now.controller;
    panel.querySelector(".about").textContent = `${chosen.about}${now.operator ? "" : "; it follows no power limit and no requests of the operator"}. A change of the controller restarts the run.`;
    panel.querySelectorAll("[data-request]").forEach((each) => { each.disabled = !now.operator; });
    panel.querySelectorAll("[data-fault]").forEach((each) => each.setAttribute("aria-pressed", now.faults.includes(each.dataset.fault)));
    const line = (text, kind) => Object.assign(document.createElement("li"), { textContent: text, className: kind });
    panel.querySelector("ol").replaceChildren(
      ...now.warnings.map((text) => line(text, "warning")),
      ...now.log.map(([time, source, what, reason]) => line(`${time.toFixed(1)} s, ${source}: ${what.replace("->", "→")}${reason ? ` (${reason})` : ""}`, source)).reverse(),
    );
    if (now.ended) this.halt(`The simulation has stopped: ${now.ended}`, true);
    else if (this.ended) this.note("");
    this.ended = Boolean(now.ended);
    this.values = now.values;
  }

  halt(text, again) {
    const halt = this.find("halt");
    halt.hidden = false;
    halt.querySelector("p").textContent = text;
    halt.querySelector("button").hidden = !again;
  }

  /** Text of the line under the title. */
  title(text) {
    this.view.root.querySelector("header .about").textContent = text;
  }

  note(text, brief = false) {
    this.find("halt").hidden = !text || brief;
    if (text && !brief) this.halt(text, false);
    if (brief) this.title(text);
  }

  /** The status, twice a second: wind, speed that is reached, frames drawn, pieces left out. */
  tell() {
    const { arrived, view, state } = this, [t0, s0] = arrived[0] || [0, 0], [t1, s1] = arrived.at(-1) || [0, 0], now = performance.now();
    const reached = t1 > t0 && now - this.latest < 2000 ? (s1 - s0) / (t1 - t0) : 0;
    const [then, frames] = this.drawn;
    this.drawn = [now, view.frames, (1000 * (view.frames - frames)) / (now - then)];
    const asked = this.values && this.values.wind_speed, wind = view.winds[0].where;
    this.title(`mean wind ${short(wind.speed)} m/s${Math.abs(asked - wind.speed) > 0.05 ? `, going to ${short(asked)} m/s` : ""}`);
    Object.assign(this, { reached });
    this.find("status").textContent = state.playing ? `${reached.toFixed(reached < 9.95 ? 1 : 0)} × real time · ${this.drawn[2].toFixed(0)} frames/s · ${this.skipped} skipped` : "paused";
  }
}
