// A small curve of one number of a topic: the first that changes, or the one that the user chose.

import { h, replace, s } from "./dom.js";
import { numbersIn } from "./message_values.js";

const POINTS = 300;
const MAX_FIELDS = 200;
const DIGITS = 6; // digits of the numbers at the ends of the range; the message below shows exact values
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
  let values = [];
  let last = new Map();

  function show(name, isByUser) {
    field = name;
    isChosen = isByUser;
    values = [];
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
    values.push(numbers.get(field));
    if (values.length > POINTS) values.shift();
    draw();
  }

  function showChanging(numbers, special) {
    const changes = (name) => last.has(name) && last.get(name) !== numbers.get(name);
    const first = special === null ? numbers.keys().next().value : "percentage";
    if (!numbers.has(field)) show(first, false);
    if (values.length > 1 && values.some((value) => value !== values[0])) return;
    const changing = changes(field) || special !== null ? field : [...numbers.keys()].find(changes);
    if (changing && changing !== field) show(changing, false);
  }

  function draw() {
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const step = values.length > 1 ? WIDTH / (values.length - 1) : 0;
    const y = (value) => (high > low ? HEIGHT - EDGE - ((value - low) / (high - low)) * (HEIGHT - 2 * EDGE) : HEIGHT / 2);
    line.setAttribute("d", `M${values.map((value, index) => `${index * step},${y(value)}`).join("L")}`);
    const [lowest, highest, newest] = [low, high, values.at(-1)].map((value) => String(Number(value.toPrecision(DIGITS))));
    replace(range, `${lowest} to ${highest}, newest ${newest}`);
  }

  return { element, take };
}
