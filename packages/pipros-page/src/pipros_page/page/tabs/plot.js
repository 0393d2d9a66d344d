// Live curves of numbers in messages. The address contains the curves and the x axis: see curve_text.js.

import { playback } from "../bags/playback.js";
import { download, h, problemLine, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { createChart, cursorText, dataOf, sampleTimeAt, timeText } from "../plot/chart.js";
import { CurveSet } from "../plot/curve_set.js";
import { curveTexts, parsedPlot, plotText } from "../plot/curve_text.js";
import { curveLegend } from "../plot/legend.js";
import { offeredFields } from "../plot/offered_fields.js";
import { referenceLines } from "../plot/reference_lines.js";
import { csvOf, rangeAfter } from "../plot/selection.js";
import { statisticsTable } from "../plot/statistics_table.js";
import { topicChoice } from "../plot/topic_choice.js";
import { toolbar } from "../toolbar.js";

const AXES = [["received", "time of arrival"], ["stamp", "header stamp"], ["ros", "ROS time"], ["xy", "first curve (x-y)"]];
const AROUND = 5; // seconds that are shown before and after a moment
const SPANS = [10, 30, 60, 300, 1800];
const HINT = "Type a topic and a field, such as /battery_topic or /imu/angular_velocity/x:y:z, or an expression over the message m, "
  + "such as /cmd_vel=hypot(m.linear.x, m.linear.y). Drag over the curves to zoom, double-click to follow again; or use +, -, the arrow " +
    "keys and 0.";

// The moment of the past or of a whole bag that all tabs show; null for the running system, and the axes stamp and xy.
const momentOf = (set) => ((playback.isRewind || set.isWhole) && !set.isXy && set.axis !== "stamp" ? playback.moment ?? null : null);

export function open(view, argument, context) {
  const set = new CurveSet(context, { change: () => { needsDraw = true; },
    fields: (curve, names) => { set.drop(curve.text); changed(); offered.show(curve.field, names); } });
  const choice = topicChoice(context, (topic) => add(topic));
  const input = h("input", { size: 34, placeholder: "/topic/field or /topic/pose/x:y:z", "aria-label": "Topic and field",
    spellcheck: "false", list: choice.names.id });
  const seconds = h("select", { "aria-label": "Time span", onchange: () => draw() },
    SPANS.map((each) => h("option", { value: each, selected: each === 30 }, each < 60 ? `${each} s` : `${each / 60} min`)));
  const low = h("input", { size: 6, placeholder: "auto", "aria-label": "Lowest value", onchange: () => rebuild() });
  const high = h("input", { size: 6, placeholder: "auto", "aria-label": "Highest value", onchange: () => rebuild() });
  const axis = h("select", { "aria-label": "X axis", onchange: () => { again(); remember(); } },
    AXES.map(([value, text]) => h("option", { value }, text)));
  const hasMarks = h("input", { type: "checkbox", onchange: () => { mark(); remember(); } });
  const hasStatistics = h("input", { type: "checkbox", onchange: () => { needsDraw = isRebuilt = true; remember(); } });
  const lines = referenceLines(() => changed());
  const isWhole = h("input", { type: "checkbox", checked: true, onchange: () => again() });
  const whole = h("label", { title: "Plot the whole bag; otherwise, the part since the last jump", hidden: true }, isWhole, "Whole bag");
  const pause = h("button", { type: "button", "aria-pressed": "false", onclick: () => setPaused(!isPaused) }, "Pause");
  const toNewest = h("button", { type: "button", hidden: true, title: "Show the newest samples again",
    onclick: () => showRange(null, true) }, "Follow");
  const error = problemLine();
  const legend = curveLegend({
    change: (curve, changes) => { set.change(curve, changes); changed(); },
    remove: (curve) => { set.drop(curve.text); changed(); },
    removeLine: lines.remove,
  }, context);
  const table = statisticsTable();
  const offered = offeredFields((text) => add(text));
  const chart = h("div", { class: "chart", tabindex: 0, role: "application",
    "aria-label": "Curves: the arrow keys move, + and - zoom, 0 follows again", onkeydown: (event) => onKey(event) });
  const csv = h("button", { type: "button", title: "Save the samples; after a zoom, those of the shown part",
    onclick: () => download("rqt_plot.csv", csvOf(set.all, shownRange()), "text/csv") }, "CSV");
  const hint = emptyState("∿", HINT, choice.buttons);
  view.append(h("div", { class: "column" },
    toolbar({ title: "Plot", tag: "form", onsubmit: (event) => { event.preventDefault(); add(input.value); } }, input, choice.names,
      h("button", {}, "Add"), pause, toNewest, h("label", {}, "Show", seconds), h("label", {}, "x", axis),
      h("label", {}, "y from", low), h("label", {}, "to", high),
        h("label", { title: "Show warnings and errors in the log as dashed lines" }, hasMarks, "Log entries"), whole,
      h("label", { title: "A horizontal line for reference" }, "Line", lines.input),
        h("label", { title: "Statistics of the samples shown" }, hasStatistics, "Statistics"), h("span", { class: "spring" }), csv),
    error.element, offered.element, legend.element, table.element, hint, chart));
  let plot = null;
  onClick(chart, () => goTo(set, plot));
  let isPaused = false;
  let isZoomed = false;
  let needsDraw = false;
  let isRebuilt = false; // then drawn even while paused
  let pausedAt = null; // the newest time when it was paused
  let moment = null; // the moment that an address names

  const remember = () => context.remember(plotText([...set.curves.keys()], axis.value, hasMarks.checked,
    { hasStatistics: hasStatistics.checked, lines: lines.values() }));
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
  const wantsWhole = () => isWhole.checked || Boolean(playback.bag?.rewind);
  const wantedSource = () => (wantsWhole() ? playback.bag : null);
  function again() {
    const before = `${set.isWhole} ${set.times}`;
    const isSame = source === wantedSource();
    set.axis = axis.value;
    set.wantsWhole = wantsWhole();
    source = wantedSource();
    if (!isSame || `${set.isWhole} ${set.times}` !== before) set.restart(); // otherwise the samples are the same
    isZoomed = false;
    moment = null;
    context.times?.forget(view);
    rebuild();
  }

  // Shows exactly the curves of an address; a link with one more field adds its curve.
  function go(text) {
    const wanted = parsedPlot(text);
    if (wanted.at !== null && !wanted.curves.length) { showMoment(wanted.at); return; }
    const isLink = wanted.curves.length === 1 && wanted.curves[0] === text;
    if (isLink && set.curves.size && !set.curves.has(text)) { add(text); return; }
    lines.set(wanted.lines);
    hasStatistics.checked = wanted.hasStatistics;
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

  // Shows the samples around a moment, and marks it.
  function showMoment(time) {
    moment = time;
    remember();
    if (!set.curves.size || set.isXy) return;
    if (!plot) rebuild();
    showRange([time - AROUND, time + AROUND], true);
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
    const end = context.times && set.axis === "received" ? context.times.range(view, set.oldest, last)[1] : last;
    return [end - Number(seconds.value), end]; // the curves grow from the right
  }

  const limit = (element) => (element.value.trim() === "" || Number.isNaN(Number(element.value)) ? null : Number(element.value));
  const shownMoment = () => moment ?? (set.isWhole && set.axis !== "stamp" ? playback.state?.moment ?? null : null);
  const axisText = () => (set.isXy ? set.all[0]?.text : AXES.find(([value]) => value === axis.value)[1]);
  const settings = () => ({ axis: axisText(), curves: set.all, limits: [limit(low), limit(high)], lines: lines.values(),
    isXy: set.isXy, span, moment: shownMoment, marks: () => set.marks });

  // The times that the user has zoomed to, or a moment's; null for all.
  const shownRange = () => (isZoomed && plot && !set.isXy ? [plot.scales.x.min, plot.scales.x.max] : null);

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
    const range = plot && !set.isXy ? rangeAfter(event.key, plot.scales.x) : undefined;
    if (range === undefined) return;
    event.preventDefault();
    showRange(range, true);
  }

  // Shows a part of the time axis; with null, follows the newest samples.
  function showRange(range, isOwn) {
    isZoomed = range !== null;
    needsDraw = isRebuilt = true;
    if (!range) moment = null;
    if (range) plot.setScale("x", { min: range[0], max: range[1] });
    if (isOwn) tell({ range });
  }

  // The plots of other panels follow the zoom and the cursor if they show times of arrival, too: see time_link.js.
  const tell = (message) => { if (set.axis === "received") context.times?.tell(plot, message); };
  let isLed = false; // by another plot
  function zoomed(own) {
    isZoomed = own.select.width > 0;
    needsDraw = isRebuilt = true;
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

  const size = () => ({ width: Math.max(200, chart.clientWidth - 8), height: Math.max(40, chart.clientHeight - 10) });

  function draw() {
    if (!plot) return;
    needsDraw = isRebuilt = false;
    drawLegend();
    error.show(set.isXy && set.curves.size < 2 ? "An x-y plot needs two curves: the first is x."
      : moment !== null && moment < set.oldest ? `There are no samples at ${timeText(moment)}: the curves begin later.` : "");
    toNewest.hidden = !isZoomed;
    replace(csv, isZoomed ? "CSV of the shown part" : "CSV");
    table.element.hidden = !hasStatistics.checked || set.isXy;
    const [begin, end] = span();
    const range = shownRange() ?? [begin, end];
    plot.setData(dataOf(settings(), range), set.isXy);
    if (set.isXy) return;
    if (hasStatistics.checked) table.draw(set.all, range);
    if (isZoomed || !end) plot.redraw();
    else plot.setScale("x", { min: begin, max: end > begin ? end : begin + 1 });
  }

  // Values at the cursor, or the newest ones.
  function drawLegend() {
    const left = plot && plot.cursor.left >= 0 ? plot.cursor.left : null;
    const sample = left === null || set.isXy ? null : sampleTimeAt(plot, set.all, left);
    const time = left === null || set.isXy ? null : sample ?? plot.posToVal(left, "x");
    const place = cursorText(plot, settings(), { left, time, isSample: sample !== null });
    legend.draw(set.all, { time: time ?? momentOf(set), place, isXy: set.isXy, lines: lines.values() });
  }

  function showSource() {
    whole.hidden = !playback.bag || playback.bag.rewind;
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

// Makes all tabs show the moment of a bag or of the past that is under the cursor.
function goTo(set, plot) {
  if (plot?.cursor.left >= 0 && set.isWhole && !set.isXy && set.axis !== "stamp") playback.jump(plot.posToVal(plot.cursor.left, "x"));
}

const MOVED_PX = 4; // a longer way of the pointer is a drag

// Calls a function when a chart is clicked, and not after a drag. uPlot stops clicks after its cursor has snapped to a sample.
function onClick(chart, act) {
  let begin = 0;
  chart.addEventListener("pointerdown", ({ clientX }) => { begin = clientX; });
  chart.addEventListener("click", ({ clientX }) => { if (Math.abs(clientX - begin) < MOVED_PX) act(); }, { capture: true });
}
