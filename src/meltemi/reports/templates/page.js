"use strict";
// Tables that sort and filter, pictures that enlarge, charts that name what is under the pointer, the command of a case.
(() => {
  const all = (selector, within = document) => [...within.querySelectorAll(selector)];
  const make = (name, attributes = {}, ...children) => {
    const svg = /^(svg|g|path|text|tspan|circle|rect|line|title)$/.test(name);
    const node = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
    node.append(...children);
    return node;
  };
  const grouped = (text) => text.replace(/^-?\d{5,}/, (whole) => whole.replace(/\B(?=(\d{3})+$)/g, "\u202f"));
  const short = (x) => (Math.abs(x) >= 1e6 || (x && Math.abs(x) < 1e-3) ? x.toExponential(3) : grouped(String(+x.toPrecision(Math.abs(x) >= 1e3 ? 6 : 4))));
  const colour = (s, i) => `var(--c${(s.colour ?? i) % 10})`;
  const data = (script) => JSON.parse(script.textContent);
  const page = data(document.getElementById("page-data"));

  // ---------------------------------------------------------------- cases
  const panel = make("aside", { id: "case", hidden: "", "aria-live": "polite" });
  document.body.append(panel);
  function showCase(name, base = 0) {
    const command = `meltemi loads show ${page.bases[base]} ${name} --plot`;
    const copy = make("button", {}, "Copy");
    copy.onclick = async () => {
      try { await navigator.clipboard.writeText(command); copy.textContent = "Copied"; } catch { getSelection().selectAllChildren(code); }
    };
    const close = make("button", { "aria-label": "Close" }, "×");
    close.onclick = () => { panel.hidden = true; };
    const code = make("code", {}, command);
    const facts = make("dl", {});
    const row = document.getElementById(`case-${base}-${name}`);
    if (row) {
      const heads = all("thead tr:last-child th", row.closest("table"));
      [...row.cells].slice(1).forEach((cell, i) => {
        if (cell.textContent) facts.append(make("div", {}, make("dt", {}, heads[i + 1].innerText.replace("\n", " ")), make("dd", {}, cell.textContent)));
      });
    }
    panel.replaceChildren(make("strong", {}, name), close, make("p", {}, code, copy), facts);
    panel.hidden = false;
  }
  document.addEventListener("click", (event) => {
    const button = event.target.closest("button.case");
    if (button) showCase(button.dataset.case || button.textContent, +(button.dataset.base || 0));
  });
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") panel.hidden = true; });

  // ---------------------------------------------------------------- tables
  const value = (cell) => {
    const number = parseFloat(cell.textContent);
    return Number.isNaN(number) ? cell.textContent : number;
  };
  const belongs = (row) => /^(\s|$)/.test(row.cells[0].textContent); // to the row above: its first cell is empty or indented
  for (const table of all("table.sortable")) {
    const body = table.tBodies[0], rows = [...body.rows];
    all("thead tr:last-child th", table).forEach((head, column) => {
      head.tabIndex = 0;
      const sort = () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        all("th[aria-sort]", table).forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const keyed = [];
        for (const row of body.rows) {
          if (keyed.length && belongs(row)) keyed.at(-1).push(row);
          else keyed.push([row.cells[column] ? value(row.cells[column]) : "", row]);
        }
        keyed.sort(([a], [b]) => {
          if (a === "" || b === "") return (a === "") - (b === "");
          const order = typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b), "en", { numeric: true });
          return down ? -order : order;
        });
        body.append(...keyed.flatMap(([, ...rows]) => rows));
      };
      head.onclick = sort;
      head.onkeydown = (event) => { if (event.key === "Enter") sort(); };
    });
    if (rows.length <= 25) continue;
    const field = make("input", { type: "search", placeholder: "filter rows", "aria-label": "Filter rows" });
    const count = make("span", {}, `${rows.length} rows`);
    const texts = rows.map((row) => [...row.cells].map((cell) => cell.textContent).join(" ").toLowerCase());
    field.oninput = () => {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      rows.forEach((row, i) => { row.hidden = !words.every((word) => texts[i].includes(word)); shown += !row.hidden; });
      count.textContent = shown < rows.length ? `${shown} of ${rows.length} rows` : `${rows.length} rows`;
    };
    table.closest(".wide").before(make("div", { class: "filter" }, field, count));
  }

  // ---------------------------------------------------------------- one of several parts
  for (const group of all(".choose")) {
    const choice = group.querySelector("select"), parts = all(":scope > .part", group);
    const show = () => {
      parts.forEach((part, i) => part.classList.toggle("aside", i !== choice.selectedIndex));
      parts.forEach((part) => all("figure.chart", part).forEach((figure) => figure.draw && figure.draw()));
    };
    choice.onchange = show;
    show();
  }

  // ---------------------------------------------------------------- contents and figures
  const links = new Map(all("nav a").map((link) => [link.hash.slice(1), link]));
  const seen = new IntersectionObserver((entries) => entries.forEach(({ target, isIntersecting }) => {
    if (isIntersecting) links.forEach((link, id) => link.classList.toggle("here", id === target.id));
  }), { rootMargin: "-10% 0px -80%" });
  all("section[id]").forEach((section) => links.has(section.id) && seen.observe(section));
  function enlarge(figure, large) {
    figure.classList.toggle("large", large);
    figure.classList.toggle("fit", large);
    figure.querySelector(".enlarge").textContent = large ? "×" : "⤢";
    document.body.style.overflow = large ? "hidden" : "";
  }
  for (const figure of all("figure:not(.sketch)")) {
    const button = make("button", { class: "enlarge", "aria-label": "Enlarge or close", title: "Enlarge" }, "⤢");
    button.onclick = () => enlarge(figure, !figure.classList.contains("large"));
    figure.append(button);
    const image = figure.querySelector("img");
    // first to the size of the window, then to that of the picture
    if (image) image.onclick = () => (figure.classList.contains("large") ? figure.classList.toggle("fit") : enlarge(figure, true));
  }
  document.addEventListener("keydown", (event) => { if (event.key === "Escape") all("figure.large").forEach((figure) => enlarge(figure, false)); });

  // ---------------------------------------------------------------- charts
  function ticks(low, high, log) {
    if (log) {
      const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9), by = Math.ceil((last - first + 1) / 8);
      return Array.from({ length: Math.max(0, Math.floor((last - first) / by) + 1) }, (_, i) => 10 ** (first + i * by));
    }
    const raw = (high - low) / 6 || 1, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((m) => m * power >= raw * 0.999);
    return Array.from({ length: Math.floor(high / step + 1e-9) - Math.ceil(low / step - 1e-9) + 1 }, (_, i) => +((Math.ceil(low / step - 1e-9) + i) * step).toPrecision(10));
  }
  const off = new WeakMap(), PAPER = 420; // [px] width of a chart that is printed only
  function draw(figure, spec) {
    const large = figure.classList.contains("large"), room = (figure.clientWidth || PAPER) - (large ? 40 : 0);
    const width = Math.max(300, large ? (spec.polar ? Math.min(room, innerHeight - 130) : room) : Math.min(room, spec.spokes ? 560 : spec.polar ? 460 : 1000));
    const height = spec.polar ? width : large ? innerHeight - 150 : Math.min(400, Math.max(250, 0.5 * width));
    const hidden = off.get(figure) || off.set(figure, new Set()).get(figure);
    const series = spec.curves.map((s, i) => ({ ...s, colour: colour(s, i) })).filter((s) => !hidden.has(s.name));
    const svg = make("svg", { class: "drawn", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": spec.title });
    const plot = spec.polar ? polar(svg, spec, series, width) : axes(svg, spec, series, width, height);
    const found = [];
    for (const s of series) {
      const points = s.x.map((x, i) => [plot(x, s.y[i]), i]).filter(([p]) => p);
      const line = (of) => of.map(([p], i) => `${i ? "L" : "M"}${p[0].toFixed(1)} ${p[1].toFixed(1)}`).join("");
      if (s.upper) {
        const back = s.x.map((x, i) => [plot(x, s.upper[i])]).filter(([p]) => p).reverse();
        svg.append(make("path", { d: points.length ? `${line([...points, ...back])}Z` : "", style: `fill:${s.colour}`, class: "band" }));
      } else if (s.dots) {
        svg.append(make("path", { d: points.map(([p]) => `M${p[0].toFixed(1)} ${p[1].toFixed(1)}h0`).join(""), style: `stroke:${s.colour}`, class: "dots" }));
      } else svg.append(make("path", { d: line(points) + (spec.polar && points.length ? "Z" : ""), style: `stroke:${s.colour}`, class: "line", "stroke-dasharray": s.dash || "none" }));
      if (!s.upper) found.push(...points.map(([p, i]) => [p, s, i]));
    }
    const mark = make("circle", { r: 5, class: "mark", visibility: "hidden" }), tip = make("div", { class: "tip", hidden: "" });
    svg.append(mark);
    let now = null;
    svg.onpointermove = svg.onpointerdown = (event) => {
      const box = svg.getBoundingClientRect(), scale = width / box.width;
      const x = (event.clientX - box.left) * scale, y = (event.clientY - box.top) * scale;
      let best = 900;
      now = null;
      for (const each of found) {
        const d = (each[0][0] - x) ** 2 + (each[0][1] - y) ** 2;
        if (d < best) { best = d; now = each; }
      }
      mark.setAttribute("visibility", now ? "visible" : "hidden");
      tip.hidden = !now;
      if (!now) return;
      const [p, s, i] = now;
      mark.setAttribute("cx", p[0]);
      mark.setAttribute("cy", p[1]);
      const name = s.cases ? page.cases[s.base || 0][s.cases[i]] : "";
      tip.replaceChildren(make("b", {}, name || s.name), ` ${name ? s.name : ""}`, make("br"),
        spec.spokes ? spec.spokes[i].replace("\n", " ") : `${spec.x.label} ${short(s.x[i])} ${spec.x.unit}`, make("br"), `${spec.y.label} ${short(s.y[i])} ${spec.y.unit}`);
      tip.style.top = `${p[1] / scale + 12}px`;
      tip.style.left = `${Math.min(p[0] / scale, box.width - 190)}px`;
    };
    svg.onpointerleave = () => { tip.hidden = true; mark.setAttribute("visibility", "hidden"); };
    svg.onclick = () => { if (now && now[1].cases) showCase(page.cases[now[1].base || 0][now[1].cases[now[2]]], now[1].base || 0); };
    const legend = make("div", { class: "legend" });
    spec.curves.forEach((s, i) => {
      const key = make("button", { "aria-pressed": !hidden.has(s.name) }, make("i", { style: `background:${colour(s, i)}` }), s.name);
      key.onclick = () => { hidden.has(s.name) ? hidden.delete(s.name) : hidden.add(s.name); draw(figure, spec); };
      if (spec.curves.findIndex((other) => other.name === s.name) === i) legend.append(key);
    });
    (figure.querySelector(".drawing") || figure.insertBefore(make("div", { class: "drawing" }), figure.querySelector("figcaption")))
      .replaceChildren(svg, tip, ...(spec.curves.length > 1 ? [legend] : []));
  }
  function axes(svg, spec, series, width, height) {
    const values = (key) => series.flatMap((s) => (key === "x" ? s.x : [...s.y, ...(s.upper || [])])).filter((v) => v !== null && (!spec[key].log || v > 0));
    const limits = (key) => {
      const { log, start } = spec[key];
      let low = Infinity, high = -Infinity;
      for (const v of values(key)) { low = Math.min(low, v); high = Math.max(high, v); }
      if (start != null) low = Math.min(low, start);
      if (low > high) [low, high] = log ? [0.1, 1] : [0, 1];
      const room = log ? 1.3 : 0.04 * (high - low || Math.abs(high) || 1);
      return log ? [low / room, high * room] : [low - room, high + room];
    };
    const [x0, x1] = limits("x"), [y0, y1] = limits("y");
    const xs = ticks(x0, x1, spec.x.log), ys = ticks(y0, y1, spec.y.log);
    const words = (v, log) => (log && (v >= 1e4 || v < 1e-2) ? v.toExponential(0) : short(v));
    const left = 14 + 7 * Math.max(...ys.map((v) => words(v, spec.y.log).length), 2), top = 26, right = width - 12, bottom = height - 40;
    const place = (v, low, high, log) => (log ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low));
    const px = (v) => left + place(v, x0, x1, spec.x.log) * (right - left), py = (v) => bottom - place(v, y0, y1, spec.y.log) * (bottom - top);
    for (const v of xs) svg.append(make("path", { d: `M${px(v)} ${top}V${bottom}`, class: "grid" }), make("text", { x: px(v), y: bottom + 16, "text-anchor": "middle" }, words(v, spec.x.log)));
    for (const v of ys) svg.append(make("path", { d: `M${left} ${py(v)}H${right}`, class: v === 0 ? "zero" : "grid" }), make("text", { x: left - 6, y: py(v) + 4, "text-anchor": "end" }, words(v, spec.y.log)));
    const named = ({ label, unit }) => `${label}${unit ? ` [${unit}]` : ""}`;
    svg.append(make("text", { x: (left + right) / 2, y: height - 6, "text-anchor": "middle" }, named(spec.x)), make("text", { x: 4, y: 14 }, named(spec.y)));
    return (x, y) => (x === null || y === null || (spec.y.log && y <= 0) || (spec.x.log && x <= 0) ? null : [px(x), py(y)]);
  }
  function polar(svg, spec, series, width) {
    const names = spec.spokes && spec.spokes.map((name) => name.split("\n")), n = names ? names.length : 12;
    const room = names ? 14 + 6.4 * Math.max(...names.flat().map((line) => line.length)) : 34;
    const centre = width / 2, radius = Math.max(centre - room, 0.2 * width), low = spec.y.start || 0;
    const largest = Math.max(...series.flatMap((s) => s.y), low + 1e-9), rings = ticks(low, largest, false).filter((v) => v > low);
    const at = (v) => (Math.max(v - low, 0) / (largest - low)) * radius;
    for (const v of rings) svg.append(make("circle", { cx: centre, cy: centre, r: at(v), class: "ring" }), make("text", { x: centre + 3, y: centre - at(v) - 2 }, short(v)));
    for (let i = 0; i < n; i++) {
      const a = (360 * i) / n, lines = names ? names[i] : [`${a}°`];
      const [s, c] = [Math.sin((a * Math.PI) / 180), Math.cos((a * Math.PI) / 180)];
      svg.append(make("path", { d: `M${centre} ${centre}L${centre + radius * c} ${centre - radius * s}`, class: "grid" }));
      const label = { "text-anchor": names && Math.abs(c) > 0.3 ? (c > 0 ? "start" : "end") : "middle" };
      const x = centre + (radius + (names ? 8 : 16)) * c, y = centre - (radius + 10 + 7 * lines.length) * s + 4 - 7 * (lines.length - 1);
      lines.forEach((line, k) => svg.append(make("text", { ...label, x, y: y + 14 * k }, line)));
    }
    svg.append(make("text", { x: 4, y: 14 }, `${spec.y.label} [${spec.y.unit}]`));
    return (x, y) => (y === null ? null : [centre + at(y) * Math.cos((x * Math.PI) / 180), centre - at(y) * Math.sin((x * Math.PI) / 180)]);
  }
  const printed = [];
  const watch = new ResizeObserver((entries) => entries.forEach(({ target }) => target.clientWidth && target.clientWidth !== target.drawn && target.draw()));
  const chart = (figure, spec) => {
    figure.draw = (printed) => { figure.drawn = figure.clientWidth; if (figure.drawn || printed === true) draw(figure, spec()); };
    watch.observe(figure);
  };
  for (const figure of all("figure[data-chart]")) {
    const spec = data(figure.querySelector("script"));
    chart(figure, () => spec);
  }

  // ---------------------------------------------------------------- statistics of all cases
  for (const figure of all("figure[data-statistics]")) {
    const bases = data(figure.querySelector("script")), [channel, across, colour] = all("select", figure);
    const field = (base, name) => base.across.find((each) => each.label === name) || base.channels.find((each) => each.label === name);
    const spec = (name, over, ends) => {
      const curves = [];
      bases.forEach((base, b) => {
        const y = field(base, name), x = field(base, over);
        if (!y || !x) return;
        const groups = bases.length > 1 ? [[base.name, base.dlc.map((_, i) => i)]] : base.dlcs.map((name, k) => [`DLC ${name}`, base.dlc.flatMap((d, i) => (d === k ? [i] : []))]);
        groups.forEach(([name, cases], k) => {
          for (const key of ends.split(" ")) {
            const from = x.max || x.values;
            curves.push({ name, colour: bases.length > 1 ? b : k, dots: true, base: b, cases, x: cases.map((i) => from[i]), y: cases.map((i) => y[key][i]) });
          }
        });
      });
      const unit = (name) => bases.map((base) => field(base, name)).find(Boolean) || {};
      return { title: `${name} over ${over}`, x: unit(over), y: unit(name), curves };
    };
    chart(figure, () => spec(channel.value, across.value, colour.value));
    for (const choice of [channel, across, colour]) choice.onchange = () => figure.draw();
    printed.push(() => { // a chart of each channel over the first abscissa
      const place = figure.nextElementSibling, x = across.options[0].value;
      place.replaceChildren(...[...channel.options].map(({ value }) => {
        const each = make("figure", { class: "chart" }, make("figcaption", {}));
        draw(each, { ...spec(value, x, colour.value), title: value });
        return each;
      }));
      const legend = place.querySelector(".legend"); // one for all
      if (legend) place.prepend(make("div", { class: "legend" }, ...legend.childNodes));
    });
  }

  // ---------------------------------------------------------------- paper: what a click would show
  addEventListener("beforeprint", () => {
    for (const figure of all("figure[data-chart]")) { draw(figure, data(figure.querySelector("script"))); figure.drawn = 0; }
    for (const each of printed) each();
  });
  addEventListener("afterprint", () => all("figure.chart").forEach((figure) => figure.draw && figure.draw()));
})();
