// Live curves of numbers in messages. The address contains the curves and the x axis: see curve_text.js.

import { playback } from "../bags/playback.js";
import { download, h, replace, uniqueId } from "../dom.js";
import { createChart, dataOf, markNear, sampleNear, timeText } from "../plot/chart.js";
import { CurveSet } from "../plot/curve_set.js";
import { curveTexts, parsedPlot, plotText } from "../plot/curve_text.js";
import { curveLegend, number } from "../plot/legend.js";

const LEVELS = { 4: "Warn", 8: "Error", 16: "Fatal" };
const AXES = [["received", "time of arrival"], ["stamp", "header stamp"], ["ros", "ROS time"], ["xy", "first curve (x-y)"]];
const MAX_OFFERED = 60; // topics
const WITHOUT_NUMBERS = new Set(["actionlib_msgs/GoalID", "rosgraph_msgs/Log", "std_msgs/Empty", "std_msgs/String",
  "tf2_msgs/TFMessage"]); // without numbers that are worth a curve
const COVARIANCE = /covariance\[\d+\]$/;
const SHORTEST = 1; // seconds of the time axis
const SPANS = [10, 30, 60, 300, 1800];
const STEPS = { ArrowLeft: [-0.2, 1], ArrowRight: [0.2, 1], "+": [0, 1 / 1.5], "=": [0, 1 / 1.5], "-": [0, 1.5], 0: [0, 0] };
const HINT = "Type a topic and a field, such as /battery_topic or /imu/angular_velocity/x:y:z, or an expression over the message m, "
  + "such as /cmd_vel=hypot(m.linear.x, m.linear.y). Drag over the curves to zoom, double click to follow again; or use +, -, the arrow " +
    "keys and 0.";

const sampleText = (sample) => (sample
  ? `nearest sample ${number(sample[0])}, ${number(sample[1])} at ${timeText(sample[2])}` : "");

export function open(view, argument, context) {
  const set = new CurveSet(context, { change: () => { needsDraw = true; }, fields: (curve, fields) => offer(curve, fields) });
  const input = h("input", { size: 34, placeholder: "/topic/field or /topic/pose/x:y:z", "aria-label": "Topic and field",
    spellcheck: "false", list: uniqueId("plot-topics") });
  const topics = h("datalist", { id: input.getAttribute("list") });
  const seconds = h("select", { "aria-label": "Time span", onchange: () => draw() },
    SPANS.map((each) => h("option", { value: each, selected: each === 30 }, each < 60 ? `${each} s` : `${each / 60} min`)));
  const low = h("input", { size: 6, placeholder: "auto", "aria-label": "Lowest value", onchange: () => rebuild() });
  const high = h("input", { size: 6, placeholder: "auto", "aria-label": "Highest value", onchange: () => rebuild() });
  const axis = h("select", { "aria-label": "X axis", onchange: () => { again(); remember(); } },
    AXES.map(([value, text]) => h("option", { value }, text)));
  const hasMarks = h("input", { type: "checkbox", onchange: () => { mark(); remember(); } });
  const isWhole = h("input", { type: "checkbox", onchange: () => again() });
  const whole = h("label", { title: "The curves of the whole bag, not from the last jump on", hidden: true }, isWhole, "Whole bag");
  const pause = h("button", { type: "button", "aria-pressed": "false", onclick: () => setPaused(!isPaused) }, "Pause");
  const toNewest = h("button", { type: "button", hidden: true, title: "Show the newest samples again",
    onclick: () => showRange(null, true) }, "Follow");
  const error = h("div", { class: "error", role: "alert" });
  const legend = curveLegend({
    change: (curve, changes) => { set.change(curve, changes); changed(); },
    remove: (curve) => { set.drop(curve.text); changed(); },
  }, context);
  const offered = h("div", { class: "bar offered", role: "group", "aria-label": "Fields" });
  const chart = h("div", { class: "chart", tabindex: 0, role: "application",
    "aria-label": "Curves: the arrow keys move, + and - zoom, 0 follows again", onkeydown: (event) => onKey(event) });
  const choice = h("div", { class: "choice", role: "group", "aria-label": "Topics" });
  const hint = h("div", { class: "note" }, HINT, choice);
  view.append(h("link", { rel: "stylesheet", href: "vendor/uPlot.css" }), h("div", { class: "column" },
    h("form", { class: "bar", onsubmit: (event) => { event.preventDefault(); add(input.value); } }, input, topics, h("button", {}, "Add"),
      pause, toNewest, h("label", {}, "Show", seconds), h("label", {}, "x", axis),
      h("label", {}, "y from", low), h("label", {}, "to", high),
        h("label", { title: "Warnings and errors of the log as dashed lines" }, hasMarks, "Log entries"), whole,
      h("span", { class: "spring" }), h("button", { type: "button", onclick: () => saveCsv() }, "CSV")),
    error, offered, legend.element, hint, chart));
  let plot = null;
  let isPaused = false;
  let isZoomed = false;
  let needsDraw = false;
  let isRebuilt = false; // drawn also while it is paused
  let pausedAt = null; // the newest time when it was paused

  context.watch("topics", {}, (data) => {
    if (topics.childElementCount === data.topics.length) return;
    replace(topics, data.topics.map((topic) => h("option", { value: topic.name })));
    const shown = data.topics.filter(({ type }) => !WITHOUT_NUMBERS.has(type)).slice(0, MAX_OFFERED);
    replace(choice, shown.map(({ name }) => h("button", { title: `Plot numbers of ${name}`, onclick: () => add(name) }, name)));
  });

  const remember = () => context.remember(plotText([...set.curves.keys()], axis.value, hasMarks.checked));
  const changed = () => { remember(); rebuild(); };

  function add(text) {
    curveTexts(text).forEach((each) => set.add(each));
    input.value = "";
    changed();
  }

  function mark() {
    set.hasMarks = hasMarks.checked;
    set.followMarks();
    needsDraw = true;
  }

  // Requests everything again, with the settings of the controls.
  let source = null; // the bag whose whole curves are shown
  const wantedSource = () => (set.isWhole ? playback.bag : null);
  function again() {
    const before = `${set.isWhole} ${set.times}`;
    const isSame = source === (isWhole.checked ? playback.bag : null);
    set.axis = axis.value;
    set.wantsWhole = isWhole.checked;
    source = wantedSource();
    if (!isSame || `${set.isWhole} ${set.times}` !== before) set.restart(); // otherwise the samples are the same
    isZoomed = false;
    context.times?.forget(view);
    rebuild();
  }

  // Offers the numbers in a topic or a part of a message that was given instead of a number.
  function offer(curve, fields) {
    set.drop(curve.text);
    changed();
    const addOne = (name) => { add(`${curve.field}${name.startsWith("[") ? "" : "/"}${name}`); replace(offered); };
    const button = (name) => h("button", { onclick: () => addOne(name) }, name);
    const [matrices, others] = [true, false].map((isWanted) => fields.filter((name) => COVARIANCE.test(name) === isWanted));
    const isFolded = matrices.length > 1 && others.length > 0;
    replace(offered, h("span", { class: "key" }, `Numbers of ${curve.field}:`), (isFolded ? others : fields).map(button),
      isFolded ? h("details", {}, h("summary", {}, `${matrices.length} covariances`), matrices.map(button)) : null,
      h("button", { class: "plain", "aria-label": "Close the choice", onclick: () => replace(offered) }, "×"));
  }

  // Shows exactly the curves of an address; a link with one more field adds its curve.
  function go(text) {
    const wanted = parsedPlot(text);
    const isLink = wanted.curves.length === 1 && wanted.curves[0] === text;
    if (isLink && set.curves.size && !set.curves.has(text)) { add(text); return; }
    for (const each of [...set.curves.keys()]) if (!wanted.curves.includes(each)) set.drop(each);
    const isSame = axis.value === wanted.axis;
    axis.value = wanted.axis;
    wanted.curves.forEach((each) => set.add(each));
    if (isSame) rebuild();
    else again();
    if (hasMarks.checked === wanted.hasMarks) return;
    hasMarks.checked = wanted.hasMarks;
    mark();
  }

  function setPaused(value) {
    isPaused = value;
    pausedAt = value ? set.newest : null;
    pause.setAttribute("aria-pressed", String(value));
    replace(pause, value ? "Resume" : "Pause");
    needsDraw = true;
  }

  // The times that the chart shows.
  function span() {
    const last = pausedAt ?? set.newest;
    if (set.isWhole) return [Math.min(set.oldest, last), last];
    if (context.times && set.axis === "received") {
      const [begin, end] = context.times.range(view, set.oldest, last);
      return [Math.min(end - SHORTEST, Math.max(end - Number(seconds.value), begin)), end];
    }
    return [Math.min(last - SHORTEST, Math.max(last - Number(seconds.value), set.oldest)), last]; // not empty at first
  }

  const limit = (element) => (element.value.trim() === "" || Number.isNaN(Number(element.value)) ? null : Number(element.value));
  const moment = () => (set.isWhole && set.axis !== "stamp" ? playback.state?.moment ?? null : null);
  const settings = () => ({ curves: set.all, limits: [limit(low), limit(high)], isXy: set.isXy, span, moment, marks: () => set.marks });

  function rebuild() {
    plot?.destroy();
    plot = null;
    hint.hidden = set.curves.size > 0;
    drawLegend(); // before measuring the chart, whose size depends on the legend's height
    if (!set.curves.size) return;
    plot = createChart(chart, size(), settings(), { zoom: zoomed, point: pointed });
    chart.ondblclick = () => showRange(null, true);
    needsDraw = isRebuilt = true;
  }

  function onKey(event) {
    if (!plot || set.isXy || !(event.key in STEPS)) return;
    event.preventDefault();
    const [shift, factor] = STEPS[event.key];
    const { min, max } = plot.scales.x;
    const [middle, half] = [(min + max) / 2 + shift * (max - min), ((max - min) * factor) / 2];
    showRange(factor ? [middle - half, middle + half] : null, true);
  }

  // Shows a part of the time axis; with null, follows the newest samples.
  function showRange(range, isOwn) {
    isZoomed = range !== null;
    needsDraw = true;
    if (range) plot.setScale("x", { min: range[0], max: range[1] });
    if (isOwn) tell({ range });
  }

  // The plots of other panels follow the zoom and the cursor if they show times of arrival, too: see time_link.js.
  const tell = (message) => { if (set.axis === "received") context.times?.tell(plot, message); };
  let isLed = false; // by another plot
  function zoomed(own) {
    isZoomed = own.select.width > 0;
    const times = [own.select.left, own.select.left + own.select.width].map((at) => own.posToVal(at, "x"));
    if (isZoomed) tell({ range: times });
  }

  function pointed(own) {
    drawLegend();
    if (!isLed) tell({ time: own.cursor.left >= 0 ? own.posToVal(own.cursor.left, "x") : null });
  }

  context.times?.listen(view, ({ plot: other, range, time }) => {
    if (!plot || other === plot || set.axis !== "received") return;
    if (range !== undefined) showRange(range, false);
    if (time === undefined) return;
    isLed = true;
    plot.setCursor(time === null ? { left: -10, top: -10 } : { left: plot.valToPos(time, "x"), top: 0 });
    isLed = false;
  }, context.signal);

  const size = () => ({ width: Math.max(200, chart.clientWidth - 8), height: Math.max(80, chart.clientHeight - 10) });

  function draw() {
    if (!plot) return;
    needsDraw = isRebuilt = false;
    drawLegend();
    replace(error, set.isXy && set.curves.size < 2 ? "An x-y plot needs two curves: the first is x." : "");
    toNewest.hidden = !isZoomed;
    plot.setData(dataOf(settings()), set.isXy);
    if (set.isXy) return;
    const [begin, end] = span();
    if (isZoomed || !end) plot.redraw();
    else plot.setScale("x", { min: begin, max: end > begin ? end : begin + 1 });
  }

  // Values at the cursor, or the newest ones.
  function drawLegend() {
    const left = plot && plot.cursor.left >= 0 ? plot.cursor.left : null;
    const time = left === null || set.isXy ? null : plot.posToVal(left, "x");
    legend.draw(set.all, { time, place: left === null ? "" : placeText(left, time), isXy: set.isXy });
  }

  function placeText(left, time) {
    if (set.isXy) return sampleText(sampleNear(plot, settings(), plot.cursor));
    const near = markNear(plot, set.marks, left);
    return `at ${timeText(time)}${near ? `: ${LEVELS[near[1]] ?? ""} ${near[2]}` : ""}`;
  }

  function saveCsv() {
    const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
    const rows = set.all.flatMap((curve) => curve.times.map((time, index) => `${time},${quoted(curve.text)},${curve.values[index] ?? ""}`));
    download("rqt_plot.csv", `time,field,value\n${rows.join("\n")}\n`, "text/csv");
  }

  function showSource() {
    whole.hidden = !playback.bag;
    if (wantedSource() !== source) again();
    needsDraw ||= set.isWhole;
  }

  context.onSource(() => {
    if (set.isWhole) return;
    set.forget();
    context.times?.forget(view);
    needsDraw = true;
  });
  playback.addEventListener("change", showSource, { signal: context.signal });
  requestAnimationFrame(function onFrame() {
    if (context.signal.aborted) return;
    if ((isRebuilt || (needsDraw && !isPaused)) && context.isShown) draw();
    requestAnimationFrame(onFrame);
  });
  new ResizeObserver(() => plot?.setSize(size())).observe(chart);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", rebuild, { signal: context.signal });
  showSource();
  if (argument) go(argument);
  return { go };
}
