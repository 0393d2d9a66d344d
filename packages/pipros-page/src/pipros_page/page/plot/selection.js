// Reading curves: moving by keys, the sample next to the cursor, and statistics and a table of the shown part.

const STEPS = { ArrowLeft: [-0.2, 1], ArrowRight: [0.2, 1], "+": [0, 1 / 1.5], "=": [0, 1 / 1.5], "-": [0, 1.5] }; // shift, factor

// A value as text: integers exactly, other numbers with 7 digits.
export const number = (value) => (value === null || value === undefined ? "–" : Object.is(value, -0) ? "-0.0"
  : String(Number.isSafeInteger(value) ? value : Number(value.toPrecision(7))));

// The labels of a vertical axis whose values are `step` apart, with enough digits to tell them apart.
export const axisLabels = (values, step) => values.map((value) => {
  const steps = Math.abs(value) / step;
  return steps < 0.5 ? "0" : String(Number(value.toPrecision(Math.min(17, Math.ceil(Math.log10(steps + 1)) + 2))));
});

// Returns the range that a key shows after another; null for following the newest samples, undefined for other keys.
export function rangeAfter(key, { min, max }) {
  if (key === "0") return null;
  if (!(key in STEPS)) return undefined;
  const [shift, factor] = STEPS[key];
  const [middle, half] = [(min + max) / 2 + shift * (max - min), ((max - min) * factor) / 2];
  return [middle - half, middle + half];
}

// Returns the time of the sample that is nearest to a time and at most `most` seconds away; null if there is none.
export function nearestTime(curves, time, most) {
  let [found, distance] = [null, most];
  for (const { times } of curves) {
    const after = firstFrom(times, time);
    for (const each of [times[after - 1], times[after]]) {
      if (each === undefined || Math.abs(each - time) > distance) continue;
      [found, distance] = [each, Math.abs(each - time)];
    }
  }
  return found;
}

// The index of the first time at or after a time, or of the first one that is not `isBefore`.
export function firstFrom(times, time, isBefore = (each) => each < time) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (isBefore(times[middle])) low = middle + 1;
    else high = middle;
  }
  return low;
}

// The samples of a curve in a range, without gaps, as [time, value]; null as the range means all.
export function samplesIn({ times, values }, range) {
  const [begin, end] = range ?? [-Infinity, Infinity];
  const found = [];
  for (let index = firstFrom(times, begin); index < times.length && times[index] <= end; index += 1) {
    if (values[index] !== null) found.push([times[index], values[index]]);
  }
  return found;
}

// Returns {count, least, most, mean, deviation, change, rate} of the samples in a range; null if there is none. `change` is from
// the first to the last sample, and `rate` the number of samples per second; null for a single one.
export function statistics(curve, range) {
  const samples = samplesIn(curve, range);
  const count = samples.length;
  if (!count) return null;
  let [least, most, sum] = [Infinity, -Infinity, 0];
  for (const [, value] of samples) [least, most, sum] = [Math.min(least, value), Math.max(most, value), sum + value];
  const mean = sum / count;
  const spread = samples.reduce((total, [, value]) => total + (value - mean) ** 2, 0);
  const [first, last] = [samples[0], samples[count - 1]];
  return { count, least, most, mean, deviation: Math.sqrt(spread / count), change: last[1] - first[1],
    rate: last[0] > first[0] ? (count - 1) / (last[0] - first[0]) : null };
}

const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

// Returns the samples in a range as text for spreadsheets. Gaps are empty values.
export function csvOf(curves, range) {
  const [begin, end] = range ?? [-Infinity, Infinity];
  const rows = curves.flatMap(({ text, times, values, exact }) => times.flatMap((time, index) =>
    (time < begin || time > end ? [] : [`${time},${quoted(text)},${exact?.get(time) ?? values[index] ?? ""}`])));
  return `${["time,field,value", ...rows].join("\n")}\n`;
}
