// Live curves of numbers in messages. The address contains the fields: #plot/field,field

import { download, h, replace, uniqueId } from "../dom.js";
import uPlot from "../vendor/uPlot.js";

const COLOURS = ["#2f6fb3", "#c0392b", "#1a7f37", "#9a6700", "#7d4cdb", "#00838f", "#ad1457", "#5d6d7e"];
const KEPT_POINTS = 50000;
const JOINED = [0, 2]; // of times and values: a missing number is a gap, also beside the samples of another curve
// Formats of the time axis, by the seconds between two labels: 24 hours, as in logs.
const TIMES = [[3600, "{HH}:{mm}", null, null, null, null, null, null, 1], [60, "{HH}:{mm}", null, null, null, null, null, null, 1], [1, ":{ss}", "\n{HH}:{mm}", null, null, null, "\n{HH}:{mm}", null, 1], [0.001, ":{ss}.{fff}", "\n{HH}:{mm}", null, null, null, "\n{HH}:{mm}", null, 1]];

export function open(view, argument, context) {
  const curves = new Map(); // field to {field, times, values, close, colour, lost}
  const input = h("input", { size: 34, placeholder: "/topic/field or /topic/pose/x:y:z", "aria-label": "Topic and field", spellcheck: "false", list: uniqueId("plot-topics") });
  const topics = h("datalist", { id: input.getAttribute("list") });
  const seconds = h("select", { "aria-label": "Time span", onchange: () => draw() }, [10, 30, 60, 300, 1800].map((span) => h("option", { value: span, selected: span === 30 }, span < 60 ? `${span} s` : `${span / 60} min`)));
  const low = h("input", { size: 6, placeholder: "auto", "aria-label": "Lowest value", onchange: () => rebuild() });
  const high = h("input", { size: 6, placeholder: "auto", "aria-label": "Highest value", onchange: () => rebuild() });
  const pause = h("button", { "aria-pressed": "false", onclick: () => setPaused(!isPaused) }, "Pause");
  const error = h("div", { class: "error", role: "alert" });
  const legend = h("div", { class: "bar legend" });
  const offered = h("div", { class: "bar offered", role: "group", "aria-label": "Fields" });
  const chart = h("div", { class: "chart", tabindex: 0, role: "application", "aria-label": "Curves: the arrow keys move, + and - zoom, 0 follows again", onkeydown: (event) => onKey(event) });
  const hint = h("div", { class: "note" }, "Type a topic and a field, such as /battery_topic or /imu/angular_velocity/x:y:z. Drag over the curves to zoom, double click to follow again; or use +, -, the arrow keys and 0.");
  view.append(h("link", { rel: "stylesheet", href: "vendor/uPlot.css" }), h("div", { class: "column" },
    h("form", { class: "bar", onsubmit: (event) => { event.preventDefault(); add(input.value); } }, input, topics, h("button", {}, "Add"), pause, h("label", {}, "Show", seconds), h("label", {}, "y from", low), h("label", {}, "to", high), h("span", { class: "spring" }), h("button", { type: "button", onclick: () => saveCsv() }, "CSV")),
    error, offered, legend, hint, chart));
  let plot = null;
  let isPaused = false;
  let isZoomed = false;
  let needsDraw = false;

  context.watch("topics", {}, (data) => {
    if (topics.childElementCount !== data.topics.length) replace(topics, data.topics.map((topic) => h("option", { value: topic.name })));
  });

  function expand(text) {
    if (text.includes("[")) return [text];
    const [first, ...others] = text.trim().split(":");
    return [first, ...others.map((other) => `${first.slice(0, first.lastIndexOf("/"))}/${other}`)];
  }

  function add(text) {
    show(text);
    remember();
  }

  function show(text) {
    const words = text.split(/[\s,]+/).filter(Boolean).map((word) => (word.startsWith("/") ? word : `/${word}`));
    for (const field of words.flatMap(expand).filter((word) => !curves.has(word))) {
      const curve = { field, times: [], values: [], lost: 0, problem: "", colour: COLOURS[curves.size % COLOURS.length] };
      curve.close = context.watch("plot", { field }, (data) => {
        curve.problem = data.error ?? "";
        if (data.fields?.length && !curve.times.length) offer(curve, data.fields);
        curve.lost += data.lost ?? 0;
        for (const [time, value] of data.samples ?? []) {
          if (curve.times.length && time < curve.times.at(-1)) continue;
          curve.times.push(time);
          curve.values.push(value);
        }
        if (curve.times.length > KEPT_POINTS * 1.2) {
          curve.times = curve.times.slice(-KEPT_POINTS);
          curve.values = curve.values.slice(-KEPT_POINTS);
        }
        needsDraw = true;
      }, (problem) => { curve.problem = problem; needsDraw = true; }, { always: true });
      curves.set(field, curve);
    }
    input.value = "";
    rebuild();
  }

  function drop(field) {
    curves.get(field).close();
    curves.delete(field);
  }

  function remove(field) {
    drop(field);
    remember();
    rebuild();
  }

  // A topic or a part of a message was given instead of a number: shows its numbers, to choose from.
  function offer(curve, fields) {
    if (!curves.has(curve.field)) return;
    remove(curve.field);
    const addOne = (name) => { add(`${curve.field}${name.startsWith("[") ? "" : "/"}${name}`); replace(offered); };
    replace(offered, h("span", { class: "key" }, `Numbers of ${curve.field}:`), fields.map((name) => h("button", { onclick: () => addOne(name) }, name)),
      h("button", { class: "plain", "aria-label": "Close the choice", onclick: () => replace(offered) }, "×"));
  }

  const remember = () => context.remember([...curves.keys()].join(","));

  // Shows exactly the curves of an address; a link to one more field adds it.
  function go(text) {
    const wanted = text.split(",").filter(Boolean).flatMap(expand);
    if (wanted.length === 1 && curves.size && !curves.has(wanted[0])) { add(text); return; }
    for (const field of [...curves.keys()]) if (!wanted.includes(field)) drop(field);
    show(text);
  }

  function setPaused(value) {
    isPaused = value;
    pause.setAttribute("aria-pressed", String(value));
    replace(pause, value ? "Go on" : "Pause");
    needsDraw = true;
  }

  function rebuild() {
    plot?.destroy();
    plot = null;
    hint.hidden = curves.size > 0;
    replace(legend);
    if (!curves.size) return;
    drawLegend(); // before measuring the chart, whose size depends on the legend's height
    const style = getComputedStyle(document.body);
    const ink = style.getPropertyValue("--ink");
    const line = style.getPropertyValue("--line");
    const axis = { stroke: ink, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 } };
    const limit = (element) => (element.value.trim() === "" || Number.isNaN(Number(element.value)) ? null : Number(element.value));
    plot = new /** @type {any} */ (uPlot)({
      ...size(),
      series: [{}, ...[...curves.values()].map((curve) => ({ label: curve.field, stroke: curve.colour, width: 1.5, spanGaps: false }))],
      axes: [{ ...axis, values: TIMES }, { ...axis, size: 64 }],
      scales: { x: { time: true }, y: { range: (_, min, max) => {
        const spread = max > min ? (max - min) * .05 : Math.abs(max) * .05 || 1;
        return [limit(low) ?? min - spread, limit(high) ?? max + spread];
      } } },
      legend: { show: false },
      cursor: { drag: { x: true, y: false } },
      hooks: { setSelect: [(own) => zoomed(own)], setCursor: [(own) => pointed(own)] },
    }, samples(), chart);
    chart.ondblclick = () => { follow(); context.times?.tell(plot, { range: null }); };
    needsDraw = true;
  }

  const follow = () => { isZoomed = false; needsDraw = true; };

  const STEPS = { ArrowLeft: [-0.2, 1], ArrowRight: [0.2, 1], "+": [0, 1 / 1.5], "=": [0, 1 / 1.5], "-": [0, 1.5], 0: [0, 0] };
  function onKey(event) {
    if (!plot || !(event.key in STEPS)) return;
    event.preventDefault();
    const [shift, factor] = STEPS[event.key];
    const { min, max } = plot.scales.x;
    const [middle, half] = [(min + max) / 2 + shift * (max - min), ((max - min) * factor) / 2];
    showRange(factor ? [middle - half, middle + half] : null);
    context.times?.tell(plot, { range: factor ? [middle - half, middle + half] : null });
  }

  // Shows a part of the time axis; with null, follows the newest samples.
  function showRange(range) {
    if (!range) { follow(); return; }
    isZoomed = true;
    plot.setScale("x", { min: range[0], max: range[1] });
  }

  // The plots of other panels follow the zoom and the cursor: see time_link.js.
  let isLed = false; // by another plot
  function zoomed(own) {
    isZoomed = own.select.width > 0;
    const times = [own.select.left, own.select.left + own.select.width].map((at) => own.posToVal(at, "x"));
    if (isZoomed) context.times?.tell(own, { range: times });
  }

  function pointed(own) {
    drawLegend();
    if (!isLed) context.times?.tell(own, { time: own.cursor.left >= 0 ? own.posToVal(own.cursor.left, "x") : null });
  }

  context.times?.listen(view, ({ plot: other, range, time }) => {
    if (!plot || other === plot) return;
    if (range !== undefined) showRange(range);
    if (time === undefined) return;
    isLed = true;
    plot.setCursor(time === null ? { left: -10, top: -10 } : { left: plot.valToPos(time, "x"), top: 0 });
    isLed = false;
  }, context.signal);

  const size = () => ({ width: Math.max(200, chart.clientWidth - 8), height: Math.max(80, chart.clientHeight - 10) });

  function samples() {
    const all = [...curves.values()];
    if (all.length === 1) return [all[0].times, all[0].values];
    return uPlot.join(all.map((curve) => [curve.times, curve.values]), all.map(() => JOINED));
  }

  function draw() {
    if (!plot) return;
    needsDraw = false;
    drawLegend();
    replace(error, "");
    plot.setData(samples(), false);
    if (!isZoomed) {
      const newest = Math.max(...[...curves.values()].map((curve) => curve.times.at(-1) ?? 0));
      const end = context.times?.end(view, newest) ?? newest;
      if (end) plot.setScale("x", { min: end - Number(seconds.value), max: end });
    } else plot.redraw();
  }

  // Values at the cursor, or the newest ones.
  function drawLegend() {
    if (!plot || legend.childElementCount !== curves.size + 1) {
      replace(legend, [...curves.values()].map((curve) => {
        const swatch = h("b", { class: "swatch" });
        swatch.style.background = curve.colour;
        return h("span", { class: "curve" }, swatch, h("span", {}), h("button", { class: "plain", "aria-label": `Remove ${curve.field}`, onclick: () => remove(curve.field) }, "×"));
      }), h("span", { class: "key at" }));
    }
    const at = plot && plot.cursor.left >= 0 && plot.cursor.idx !== null ? plot.posToVal(plot.cursor.left, "x") : null;
    [...curves.values()].forEach((curve, index) => {
      const value = curve.values[at === null ? curve.values.length - 1 : sampleAt(curve.times, at)];
      const text = `${curve.field}: ${number(value)}${curve.lost ? ` (${curve.lost} not shown)` : ""} ${curve.problem}`;
      const label = legend.children[index].children[1];
      if (label.textContent !== text) label.textContent = text;
    });
    legend.lastChild.textContent = at === null ? "" : `at ${clock(at)}`;
  }

  function saveCsv() {
    const rows = [...curves.values()].flatMap((curve) => curve.times.map((time, index) => `${time},${curve.field},${curve.values[index] ?? ""}`));
    download("rqt_plot.csv", `time,field,value\n${rows.join("\n")}\n`, "text/csv");
  }

  context.onSource(() => {
    for (const curve of curves.values()) Object.assign(curve, { times: [], values: [], lost: 0 });
    context.times?.forget(view);
    needsDraw = true;
  });
  requestAnimationFrame(function onFrame() {
    if (context.signal.aborted) return;
    if (needsDraw && !isPaused && context.isShown) draw();
    requestAnimationFrame(onFrame);
  });
  new ResizeObserver(() => plot?.setSize(size())).observe(chart);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", rebuild, { signal: context.signal });
  if (argument) show(argument);
  return { go };
}

// The index of the newest sample at a time or before.
function sampleAt(times, time) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= time) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

const number = (value) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(7))));
const clock = (seconds) => new Date(seconds * 1000).toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit", second: "2-digit", fractionalSecondDigits: 2 });
