// The chart of curves: options and hooks for uPlot.

import uPlot from "../vendor/uPlot.js";
import { pairs } from "./curve.js";
import { axisLabels, firstFrom, nearestTime, number } from "./selection.js";

const JOINED = [0, 2]; // uPlot.join's null modes of times and values: a missing number is a gap, also among other samples
const EPOCH = 1e8; // smaller times are simulated, and shown in seconds
const MARGIN = 0.05;
const SNAP_PX = 40;
const LOW_PX = 160; // lower charts have one line of times, and no label below it
const MANY = 20; // more curves have thin lines, which are drawn several times faster without a graphics card
const FONT = "11px system-ui, sans-serif"; // of axes
// Creating a format takes longer than drawing a curve.
const clock = new Intl.DateTimeFormat("en-GB", { hour: "2-digit", minute: "2-digit", second: "2-digit", fractionalSecondDigits: 2 });
const minutes = new Intl.DateTimeFormat("en-GB", { hour: "2-digit", minute: "2-digit" });
const LEVELS = { 4: "--warn", 8: "--bad", 16: "--bad" };

const colourOf = (name) => getComputedStyle(document.body).getPropertyValue(name);
// The margin beyond the values; no smaller than what numbers of that size can tell apart.
const spread = (low, high) => (high > low ? Math.max((high - low) * MARGIN, Math.abs(high) * 1e-13) : Math.abs(high) * MARGIN || 1);

// A time of day, or simulated seconds.
export const timeText = (time) => (time < EPOCH ? `${Number(time.toFixed(2))} s` : clock.format(time * 1000));

// Labels of the time axis: 24 hours, as in logs; seconds, with the minute once.
function timeLabels(own, splits, _axis, _space, step) {
  let last = "";
  return splits.map((time) => {
    if (splits.at(-1) < EPOCH) return `${Number(time.toFixed(3))} s`;
    const date = new Date(time * 1000);
    const minute = minutes.format(date);
    if (step >= 60) return minute;
    const fraction = step < 1 ? `.${String(date.getMilliseconds()).padStart(3, "0")}` : "";
    const seconds = `:${String(date.getSeconds()).padStart(2, "0")}${fraction}`;
    if (minute === last || own.height < LOW_PX) return seconds;
    last = minute;
    return `${seconds}\n${minute}`;
  });
}

// Returns the height of the time axis, and shows or hides its label.
const timeAxisSize = (label) => (own, _values, index) => {
  const isLow = own.height < LOW_PX;
  own.axes[index].label = isLow ? null : label;
  return isLow ? 24 : 50;
};

// The range of a vertical axis; `limits` has null where it follows the values and lines. Its length is finite, also around 1e308.
const rangeOf = (limits, lines = []) => (_own, least, most) => {
  const [low, high] = [Math.min(least, ...lines), Math.max(most, ...lines)];
  const within = (margin, farthest) => [Math.max(-farthest, low - margin), Math.min(farthest, high + margin)];
  const usual = within(spread(low, high), Number.MAX_VALUE);
  const [from, to] = Number.isFinite(usual[1] - usual[0]) ? usual : within(0, Number.MAX_VALUE / (Number.isFinite(high - low) ? 1 : 2));
  return [limits[0] ?? from, limits[1] ?? to];
};

// Steps between labels. uPlot has the same, but none beyond 1e32.
const STEPS = Array.from({ length: 340 }, (_, at) => [1, 2, 2.5, 5].map((each) => Number(`${each}e${at - 32}`))).flat();
const LETTER_PX = 7;

// Returns the width of a vertical axis: more for long labels only, so that axes of charts stay below one another.
const widthOf = (_own, labels) => Math.max(64, 20 + LETTER_PX * Math.max(0, ...(labels ?? []).map(({ length }) => length)));

// Creates a chart in `place`. `settings` has `axis` (what the horizontal axis shows), `curves`, `limits`, `lines` (values), `isXy`,
// `marks()`, `moment()` and `span()`; `on` has `zoom` and `point`.
export function createChart(place, size, settings, on) {
  const { curves, isXy } = settings;
  const axis = { stroke: colourOf("--pale"), font: FONT, grid: { stroke: colourOf("--line"), width: 1 },
    ticks: { stroke: colourOf("--line"), width: 1 } };
  const upright = { ...axis, size: widthOf, incrs: STEPS, values: (_own, splits, _axis, _space, step) => axisLabels(splits, step) };
  const shown = isXy ? curves.slice(1) : curves;
  const hasRight = shown.some((curve) => curve.isRight);
  const hasLeft = !hasRight || shown.some((curve) => !curve.isRight);
  const width = curves.length > MANY ? 1 : 1.5;
  const series = curves.map((curve) => ({
    label: curve.text, stroke: curve.colour, width, spanGaps: false, scale: curve.isRight ? "right" : "y",
    ...(isXy ? { paths: () => null, points: { show: false } } : {}),
  }));
  const drawMore = isXy ? drawPairs : drawMarks;
  const lineScale = hasLeft ? "y" : "right";
  const hooks = { setSelect: [on.zoom], setCursor: [on.point], draw: [(own) => {
    drawMore(own, settings);
    drawLines(own, settings.lines, lineScale);
  }] };
  const linesOf = (scale) => (scale === lineScale ? settings.lines : []);
  const timeScales = { x: { time: true }, y: { range: rangeOf(settings.limits, linesOf("y")) },
    right: { range: rangeOf([null, null], linesOf("right")) } };
  return new /** @type {any} */ (uPlot)({
    ...size,
    series: [{}, ...series],
    axes: [{ ...axis, values: isXy ? undefined : timeLabels, label: settings.axis, labelSize: 16, labelFont: FONT,
      size: timeAxisSize(settings.axis) },
      ...(hasLeft ? [{ ...upright, scale: "y" }] : []),
      ...(hasRight ? [{ ...upright, scale: "right", side: 1, grid: hasLeft ? { show: false } : axis.grid }] : [])],
    scales: isXy ? xyScales(settings) : timeScales,
    legend: { show: false },
    cursor: { drag: { x: !isXy, y: false }, points: { show: !isXy }, ...(isXy ? {} : { move: snap(settings) }) },
    hooks,
  }, dataOf(settings), place);
}

// The data for uPlot: the samples in a range, and one more at each end, because older ones would make each picture slower than the
// last one. For x-y curves, only their extent, because uPlot would sort the points by x.
export function dataOf(settings, [begin, end] = settings.span()) {
  const { curves, isXy } = settings;
  if (isXy) return [xExtent(settings), ...curves.map(() => [0, 1])];
  const part = (times, all) => all.slice(Math.max(0, firstFrom(times, begin) - 1), firstFrom(times, end) + 1);
  const shown = curves.map(({ times, values }) => [part(times, times), part(times, values)]);
  return shown.length === 1 ? shown[0] : uPlot.join(shown, curves.map(() => JOINED));
}

// The curves over the first, as {curve, points}.
const pairedCurves = ({ curves, span }) => curves.slice(1).map((curve) => ({ curve, points: pairs(curves[0], curve, span()) }));

function extent(numbers) {
  let [low, high] = [Infinity, -Infinity];
  for (const each of numbers) {
    low = Math.min(low, each);
    high = Math.max(high, each);
  }
  return low > high ? [0, 1] : [low, high];
}

const coordinates = (paired, at) => extent(paired.flatMap(({ points }) => points.filter(Boolean).map((point) => point[at])));
const xExtent = (settings) => coordinates(pairedCurves(settings), 0);

function xyScales(settings) {
  const of = (isRight) => coordinates(pairedCurves(settings).filter(({ curve }) => curve.isRight === isRight), 1);
  return {
    x: { time: false, range: () => rangeOf([null, null])(null, ...xExtent(settings)) },
    y: { range: () => rangeOf(settings.limits)(null, ...of(false)) },
    right: { range: () => rangeOf([null, null])(null, ...of(true)) },
  };
}

// Returns how the cursor moves: to the nearest sample or log entry, if one is near. A part is selected as it is drawn: otherwise,
// both of its ends could be the same sample.
const snap = ({ curves, marks }) => (own, left, top) => {
  if (own.cursor.event?.buttons) return [left, top];
  const times = left < 0 ? [] : [sampleTimeAt(own, curves, left), markNear(own, marks(), left)?.[0] ?? null];
  const places = times.filter((time) => time !== null).map((time) => own.valToPos(time, "x"));
  places.sort((one, other) => Math.abs(one - left) - Math.abs(other - left));
  return [places[0] ?? left, top];
};

// Returns the time of the sample nearest to a place in pixels; null if none is near.
export function sampleTimeAt(own, curves, left) {
  const [time, end] = [left, left + SNAP_PX].map((at) => own.posToVal(at, "x"));
  return nearestTime(curves, time, end - time);
}

function clipped(own, draw) {
  const { left, top, width, height } = own.bbox;
  own.ctx.save();
  own.ctx.beginPath();
  own.ctx.rect(left, top, width, height);
  own.ctx.clip();
  draw(own.ctx, { top, bottom: top + height });
  own.ctx.restore();
}

function drawPairs(own, settings) {
  clipped(own, (drawing) => {
    for (const { curve, points } of pairedCurves(settings)) {
      drawing.beginPath();
      drawing.strokeStyle = curve.colour;
      drawing.lineWidth = 1.5 * devicePixelRatio;
      let isDown = false;
      for (const point of points) {
        if (point) {
          const place = [own.valToPos(point[0], "x", true), own.valToPos(point[1], curve.isRight ? "right" : "y", true)];
          if (isDown) drawing.lineTo(place[0], place[1]);
          else drawing.moveTo(place[0], place[1]);
        }
        isDown = Boolean(point);
      }
      drawing.stroke();
    }
  });
}

// Returns the sample of an x-y plot that is nearest to a place in pixels: [x, y, time]; null if there is none.
function sampleNear(own, settings, { left, top }) {
  let [found, nearest] = [null, Infinity];
  for (const { curve, points } of pairedCurves(settings)) for (const point of points.filter(Boolean)) {
    const [x, y] = [own.valToPos(point[0], "x"), own.valToPos(point[1], curve.isRight ? "right" : "y")];
    const distance = Math.hypot(x - left, y - top);
    if (distance < nearest) [found, nearest] = [point, distance];
  }
  return found;
}

// Log entries as dashed lines, and the moment of a bag.
function drawMarks(own, { marks, moment }) {
  const line = (drawing, { top, bottom }, time, colour, dash) => {
    const at = Math.round(own.valToPos(time, "x", true)) + 0.5;
    drawing.beginPath();
    drawing.strokeStyle = colour;
    drawing.lineWidth = devicePixelRatio;
    drawing.setLineDash(dash);
    drawing.moveTo(at, top);
    drawing.lineTo(at, bottom);
    drawing.stroke();
  };
  clipped(own, (drawing, edges) => {
    for (const [time, level] of marks()) line(drawing, edges, time, colourOf(LEVELS[level] ?? "--pale"), [4, 3]);
    if (moment() !== null) line(drawing, edges, moment(), colourOf("--accent"), []);
  });
}

// Horizontal reference lines with their values.
function drawLines(own, values, scale) {
  if (!values.length) return;
  clipped(own, (drawing) => {
    const { left, width } = own.bbox;
    drawing.strokeStyle = drawing.fillStyle = colourOf("--ink");
    drawing.lineWidth = devicePixelRatio;
    drawing.setLineDash([6, 4]);
    Object.assign(drawing, { textAlign: "left", textBaseline: "bottom" });
    drawing.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    for (const value of values) {
      const at = Math.round(own.valToPos(value, scale, true)) + 0.5;
      drawing.beginPath();
      drawing.moveTo(left, at);
      drawing.lineTo(left + width, at);
      drawing.stroke();
      drawing.fillText(String(value), left + 4 * devicePixelRatio, at - 3 * devicePixelRatio);
    }
  });
}

const NAMES = { 4: "Warn", 8: "Error", 16: "Fatal" };

// Describes what is at the cursor, `left` pixels from the left edge; empty if `left` is null, or nothing is there.
export function cursorText(own, settings, { left, time, isSample }) {
  if (left === null) return "";
  if (settings.isXy) {
    const near = sampleNear(own, settings, own.cursor);
    return near ? `nearest sample ${number(near[0])}, ${number(near[1])} at ${timeText(near[2])}` : "";
  }
  const mark = markNear(own, settings.marks(), left);
  return `${isSample ? "sample " : ""}at ${timeText(time)}${mark ? `: ${NAMES[mark[1]] ?? ""} ${mark[2]}` : ""}`;
}

// The mark next to the cursor, at most some pixels away.
function markNear(own, marks, left) {
  const NEAR = 6;
  let [found, nearest] = [null, NEAR];
  for (const mark of marks) {
    const distance = Math.abs(own.valToPos(mark[0], "x") - left);
    if (distance < nearest) [found, nearest] = [mark, distance];
  }
  return found;
}
