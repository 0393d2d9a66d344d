// Copying to the clipboard, and buttons for it.

import { h } from "./dom.js";

const SHOWN_MS = 1200;

// Copies a text. Without TLS, browsers offer the clipboard to pages of this computer only; elsewhere a selection is copied.
async function copyText(text) {
  if (navigator.clipboard) {
    await navigator.clipboard.writeText(text);
    return;
  }
  const area = h("textarea", { class: "offscreen", "aria-hidden": "true" });
  area.value = text;
  document.body.append(area);
  area.select();
  const isCopied = document.execCommand("copy");
  area.remove();
  if (!isCopied) throw new Error("the browser does not allow copying");
}

// A button that copies what `textOf` returns or promises. `onError` gets the text of an error.
export function copyButton(title, textOf, onError) {
  const button = h("button", { title: `Copy as ${title}`, onclick: async () => {
    try {
      await copyText(await textOf());
      button.textContent = "copied";
      setTimeout(() => { button.textContent = title; }, SHOWN_MS);
    } catch (problem) {
      onError(problem.message);
    }
  } }, title);
  return button;
}

// Makes a click on the name of a field in a tree copy the field's value: see `entry` in message_values.js.
export function copiesValues(element, onError) {
  element.addEventListener("click", async (event) => {
    const name = event.target.closest("button.key");
    if (!name) return;
    try {
      let value = name.nextElementSibling;
      if (value instanceof HTMLDetailsElement) {
        value.open = true; // innerText has line breaks only for visible elements
        value = value.lastElementChild;
      }
      await copyText(value.dataset.text ?? value.innerText.trim());
      name.classList.add("copied");
      setTimeout(() => name.classList.remove("copied"), SHOWN_MS);
    } catch (problem) {
      onError(problem.message);
    }
  });
  return element;
}
