// A small curve of one number of a topic: the first that changes, or the one that the user chose.

import { h, replace, s } from "./dom.js";
import { numbersIn } from "./message_values.js";
import { number } from "./plot/selection.js";
import { Gaps } from "./stale.js";

const POINTS = 300;
const MAX_FIELDS = 200;
const [WIDTH, HEIGHT, EDGE] = [300, 60, 3];

// Returns {element, take(message)}.
export function smallCurve() {
  const choice = h("select", { "aria-label": "Field of the curve", onchange: () => show(choice.value, true) });
  const line = s("path", {});
  const picture = s("svg", { class: "spark", viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img" }, line);
  const range = h("div", { class: "key range" });
  const element = h("div", { class: "curve", hidden: true }, choice, picture, range);
  let field = null;
  let isChosen = false; // whether the user chose the field
  let values = []; // NaN where the line is interrupted
  let gaps = new Gaps();
  let last = new Map();

  function show(name, isByUser) {
    field = name;
    isChosen = isByUser;
    values = [];
    gaps = new Gaps();
    choice.value = name;
    picture.setAttribute("aria-label", `Curve of ${name}`);
  }

  // `special` is the value of the gauge, which the curve shows first, or null if there is no gauge.
  function take(message, special = null) {
    const numbers = new Map(numbersIn(message, MAX_FIELDS));
    if (special !== null) numbers.set("percentage", special);
    element.hidden = numbers.size === 0;
    if (!numbers.size) return;
    if ([...choice.options].map((option) => option.value).join() !== [...numbers.keys()].join()) {
      replace(choice, [...numbers.keys()].map((name) => h("option", { value: name }, name)));
      choice.value = field ?? "";
      choice.disabled = numbers.size === 1;
    }
    if (!isChosen) showChanging(numbers, special);
    last = numbers;
    if (!numbers.has(field)) return;
    if (gaps.note(performance.now() / 1000)) values.push(NaN);
    values.push(numbers.get(field));
    values.splice(0, values.length - POINTS);
    draw();
  }

  function showChanging(numbers, special) {
    const changes = (name) => last.has(name) && !Object.is(last.get(name), numbers.get(name));
    const first = special === null ? numbers.keys().next().value : "percentage";
    if (!numbers.has(field)) show(first, false);
    if (values.length > 1 && values.some((value) => value !== values[0])) return;
    const changing = changes(field) || special !== null ? field : [...numbers.keys()].find(changes);
    if (changing && changing !== field) show(changing, false);
  }

  function draw() {
    const finite = values.filter(Number.isFinite);
    const [low, high] = [Math.min(...finite), Math.max(...finite)];
    const step = values.length > 1 ? WIDTH / (values.length - 1) : 0;
    const y = (value) => (high > low ? HEIGHT - EDGE - ((value - low) / (high - low)) * (HEIGHT - 2 * EDGE) : HEIGHT / 2);
    line.setAttribute("d", values.map((value, index) => (!Number.isFinite(value) ? ""
      : `${Number.isFinite(values[index - 1]) ? "L" : "M"}${index * step},${y(value)}`)).join(""));
    const [lowest, highest, newest] = [low, high, values.at(-1)].map(number);
    replace(range, finite.length ? `${lowest} to ${highest}, newest ${newest}` : `newest ${newest}`);
  }

  return { element, take };
}
