// Horizontal reference lines at values that the user types.

import { h } from "../dom.js";

const MAX_LINES = 10;

// `onChange()` is called after the user has added or removed a line. Returns {input, values(), set(values), remove(value)}.
export function referenceLines(onChange) {
  let values = [];
  const set = (next) => { values = [...new Set(next)].slice(-MAX_LINES); };
  const input = h("input", { size: 6, placeholder: "value", "aria-label": "Line at a value", onchange: () => {
    const value = Number(input.value);
    if (input.value.trim() === "" || !Number.isFinite(value)) return;
    input.value = "";
    set([...values, value]);
    onChange();
  } });
  const remove = (value) => {
    set(values.filter((each) => each !== value));
    onChange();
  };
  return { input, values: () => values, set, remove };
}
