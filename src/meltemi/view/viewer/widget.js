// The view as a widget of a notebook (anywidget): its data are traits, and so are the time and whether it plays.

const RATE = 5; // [Hz] at which Python learns the time while the view plays

/** Theme of the notebook around an element: light text is on dark ground. */
function themeAround(element) {
  const [red, green, blue] = getComputedStyle(element).color.match(/[\d.]+/g).map(Number);
  return red + green + blue > 384 ? "dark" : "light";
}

export default {
  render({ model, el }) {
    const host = document.createElement("div"), shadow = host.attachShadow({ mode: "open" });
    host.dataset.lmSuppressShortcuts = "true"; // the keys are those of the view while it has the focus
    shadow.innerHTML = `<style>${model.get("style")}</style><div class="view">${model.get("content")}</div>`;
    el.append(host);
    const spec = { ...model.get("spec") }, bytes = (part) => new Uint8Array(part.buffer, part.byteOffset, part.byteLength);
    spec.theme ||= themeAround(el);
    spec.begin = model.get("time");
    const scenes = model.get("scenes").map((part) => readScene(bytes(part)));
    const view = mountView(shadow.querySelector(".view"), { spec, scenes, licence: model.get("licence") }, host);
    host.view = view;
    if (!view.stop) return undefined; // a browser without WebGL
    const { state, begin } = view;
    const told = { time: model.get("time"), playing: state.playing };
    const tell = () => {
      const now = { time: begin + state.t, playing: state.playing };
      const changed = Object.keys(now).filter((name) => now[name] !== told[name]);
      Object.assign(told, now);
      changed.forEach((name) => model.set(name, now[name]));
      if (changed.length) model.save_changes();
    };
    const hear = () => {
      const [time, playing] = [model.get("time"), model.get("playing")];
      // two views of one widget that play remain within half a second
      if (time !== told.time && !(playing && Math.abs(time - begin - state.t) < 0.5)) state.t = Math.min(Math.max(time - begin, 0), view.duration);
      if (playing !== told.playing) state.playing = playing;
      Object.assign(told, { time, playing });
      state.dirty = true;
    };
    model.on("change:time", hear);
    model.on("change:playing", hear);
    const clock = setInterval(tell, 1000 / RATE);
    return () => {
      clearInterval(clock);
      model.off("change:time", hear);
      model.off("change:playing", hear);
      view.stop();
    };
  },
};
