// Buttons for the numbers in a topic or field that the user gave instead of a number.

import { h, replace } from "../dom.js";

const COVARIANCE = /covariance\[\d+\]$/;

// `onChoose(text)` is called with the text of the chosen curve. Returns {element, show(field, names)}.
export function offeredFields(onChoose) {
  const element = h("div", { class: "bar offered", role: "group", "aria-label": "Fields" });

  function show(field, names) {
    const choose = (name) => {
      onChoose(`${field}${name.startsWith("[") ? "" : "/"}${name}`);
      replace(element);
    };
    const button = (name) => h("button", { onclick: () => choose(name) }, name);
    const [matrices, others] = [true, false].map((isWanted) => names.filter((name) => COVARIANCE.test(name) === isWanted));
    const isFolded = matrices.length > 1 && others.length > 0;
    replace(element, h("span", { class: "key" }, `Numbers of ${field}:`), (isFolded ? others : names).map(button),
      isFolded ? h("details", {}, h("summary", {}, `${matrices.length} covariances`), matrices.map(button)) : null,
      h("button", { class: "plain", "aria-label": "Close the choice", onclick: () => replace(element) }, "×"));
  }

  return { element, show };
}
