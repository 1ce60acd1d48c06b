"use strict";
// Plots of channels over time, with a cursor that all of them and the turbine share.

class Plot {
  /** ``spec``: title, unit, zero [s] of its times, lines as of plotLine. */
  constructor(parent, spec, seek) {
    Object.assign(this, spec);
    const figure = document.createElement("figure");
    figure.className = "plot";
    figure.innerHTML = '<figcaption><b></b> <span class="unit"></span><span class="values"></span></figcaption><div><canvas></canvas><i class="cursor"></i></div>';
    figure.querySelector("b").textContent = this.title;
    figure.querySelector(".unit").textContent = this.unit;
    this.values = this.lines.map((line) => {
      const value = document.createElement("span");
      value.style.color = `var(${line.colour})`;
      value.title = line.name;
      return value;
    });
    figure.querySelector(".values").append(...this.values);
    this.canvas = figure.querySelector("canvas");
    this.cursor = figure.querySelector(".cursor");
    parent.append(figure);
    const drag = (event) => {
      if (event.type === "pointermove" && !event.buttons) return;
      const box = this.canvas.getBoundingClientRect();
      seek(this.begin + (this.end - this.begin) * Math.min(Math.max((event.clientX - box.left - this.left) / (box.width - this.left), 0), 1));
    };
    this.canvas.addEventListener("pointerdown", drag);
    this.canvas.addEventListener("pointermove", drag);
    this.left = 44;
  }

  /** Draw the lines between two times [s]. */
  draw(begin, end) {
    Object.assign(this, { begin, end });
    const { canvas, left, zero } = this, ratio = Math.min(devicePixelRatio, 2), width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const pen = canvas.getContext("2d"), style = getComputedStyle(canvas);
    pen.scale(ratio, ratio);
    const foot = Number(style.getPropertyValue("--foot")), floor = height - foot; // below it, the numbers of the time axis
    const columns = Math.max(Math.round(width - left), 2), curves = this.lines.map((line) => line.envelope(begin, end, columns));
    let [low, high] = curves.reduce(([a, b], c) => [Math.min(a, c.low), Math.max(b, c.high)], [Infinity, -Infinity]);
    if (!Number.isFinite(high - low)) [low, high] = [0, 1]; // no samples yet
    if (!(high - low > 1e-6 * Math.max(Math.abs(high), Math.abs(low), 1e-3))) [low, high] = [low - Math.max(0.05 * Math.abs(low), 0.5), high + Math.max(0.05 * Math.abs(high), 0.5)];
    const margin = 0.06 * (high - low), y = (v) => floor - 3 - ((floor - 8) * (v - low + margin)) / (high - low + 2 * margin);
    pen.font = "10px system-ui, sans-serif";
    pen.textBaseline = "middle";
    pen.fillStyle = style.getPropertyValue("--line");
    const times = ticks(zero + begin, zero + end, 4), across = (t) => left + ((width - left) * (t - zero - begin)) / (end - begin);
    times.found.forEach((t) => pen.fillRect(Math.min(Math.round(across(t)), width - 1), 5, 1, floor - 5));
    if (foot) {
      pen.fillStyle = style.getPropertyValue("--soft");
      const last = times.found.at(-1);
      for (const t of times.found) {
        const text = tickText(t, times.step) + (t === last ? " s" : ""), half = pen.measureText(text).width / 2;
        pen.textAlign = "center";
        pen.fillText(text, Math.min(across(t), width - half), floor + 0.6 * foot);
      }
    }
    pen.textAlign = "right";
    const { found, step } = ticks(low, high, floor > 75 ? 3 : 2), each = Math.ceil(13 / (y(0) - y(step))); // a low plot has fewer numbers
    found.forEach((tick, i) => {
      pen.fillStyle = style.getPropertyValue("--line");
      pen.fillRect(left, Math.round(y(tick)), width - left, 1);
      pen.fillStyle = style.getPropertyValue("--soft");
      if (i % each === 0) pen.fillText(tickText(tick, step), left - 6, Math.min(Math.max(y(tick), 6), floor - 6));
    });
    curves.reverse().forEach((curve, k) => { // the first one lies above the others
      const i = curves.length - 1 - k;
      pen.strokeStyle = style.getPropertyValue(this.lines[i].colour);
      pen.lineWidth = 1.3;
      pen.lineJoin = "round";
      pen.beginPath();
      curve.points.forEach(([x, v]) => pen.lineTo(left + x, y(v)));
      pen.stroke();
    });
  }

  /** Move the cursor, and show the values there. */
  at(t) {
    const share = (t - this.begin) / (this.end - this.begin), width = this.canvas.clientWidth - this.left;
    this.cursor.style.transform = `translateX(${this.left + Math.min(Math.max(share, 0), 1) * width}px)`;
    this.values.forEach((value, i) => { value.textContent = short(this.lines[i].at(t)); });
  }
}

/** A recorded series of channels: its samples ``first`` to ``rows`` - 1, by number and column. */
function recordedSeries(scene) {
  const { amplitude, mean, scale, rows, step, count } = new Track(scene, "plot", scene.about.steps.plot);
  return { first: 0, rows, step, value: (i, column) => mean[column] + scale[column] * amplitude[i * count + column] };
}

/** A line of a plot: a column of a series. */
function plotLine(series, column, look) {
  const { step } = series, value = (i) => series.value(i, column);
  return {
    ...look,
    at(t) {
      const [i, j, w] = place(t, step, series.rows);
      return t > (series.rows - 0.5) * step ? NaN : (1 - w) * value(i) + w * value(j);
    },
    // where there are more samples than columns: the least and the largest of each
    envelope(begin, end, columns) {
      const first = Math.max(Math.floor(begin / step), series.first), last = Math.min(Math.ceil(end / step), series.rows - 1), points = [];
      const x = (i) => ((i * step - begin) / (end - begin)) * columns, each = Math.max(1, Math.floor((last - first) / columns / 2));
      let low = Infinity, high = -Infinity;
      for (let i = first; i <= last; i += each) {
        let a = i, b = i;
        for (let j = i; j < Math.min(i + each, last + 1); j++) {
          if (value(j) < value(a)) a = j;
          if (value(j) > value(b)) b = j;
        }
        low = Math.min(low, value(a));
        high = Math.max(high, value(b));
        for (const j of a === b ? [a] : [Math.min(a, b), Math.max(a, b)]) points.push([x(j), value(j)]);
      }
      return { points, low, high };
    },
  };
}

/** At least some round numbers within an interval, and their step. */
function ticks(low, high, least) {
  let power = 10 ** Math.ceil(Math.log10(high - low)), found = [], step = power;
  for (; found.length < least; power /= 10) {
    for (const f of [1, 0.5, 0.2]) {
      step = f * power;
      found = [];
      for (let i = Math.ceil(low / step - 1e-9); i * step <= high * (1 + 1e-12); i++) found.push(i * step);
      if (found.length >= least) return { found, step };
    }
  }
  return { found, step };
}

function tickText(value, step) {
  return grouped(value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9))));
}
