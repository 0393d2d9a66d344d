// The button "Why no data?": the server examines a topic, and the first step that fails is shown with what to do.

import { playback } from "./bags/playback.js";
import { h, replace } from "./dom.js";

// Returns {element, offer}. `offer(topic)` shows the button for a topic, or hides it and its answer if the topic is empty.
// While a bag is open there is no button, because only the running system can be examined.
export function whyNoData(context) {
  const answer = h("div", { role: "status" });
  const button = h("button", { type: "button", title: "Examine the topic (w)", "aria-keyshortcuts": "w",
    onclick: (event) => { event.preventDefault(); ask(); } }, "Why no data?");
  const element = h("div", { class: "why", hidden: true }, button, answer);
  let topic = "";

  function offer(name) {
    name = playback.bag ? "" : name;
    if (name === topic) return;
    topic = name;
    element.hidden = !name;
    button.setAttribute("aria-label", `Why no data on ${name}?`);
    replace(answer);
  }

  async function ask() {
    const asked = topic;
    button.disabled = true;
    replace(answer, h("p", { class: "pale" }, `Examining ${asked} for a few seconds …`));
    try {
      const check = await context.act("why_no_data", { name: asked });
      if (topic === asked) replace(answer, answerOf(check));
    } catch (problem) {
      if (topic === asked) replace(answer, h("p", { class: "error" }, problem.message));
    }
    button.disabled = false;
  }

  return { element, offer };
}

// The answer and its steps as elements.
export function answerOf({ steps, finding }) {
  const list = h("ol", {}, steps.map(({ step, passes, text }) =>
    h("li", { class: passes ? "passes" : "fails" }, h("span", { class: "key" }, `${passes ? "✓" : "✗"} ${step}: `), text)));
  if (!finding) return [h("p", {}, "Nothing is wrong with the topic."), list];
  return [h("p", { class: finding.severity }, `${finding.summary}.`), h("p", {}, finding.cure),
    h("details", {}, h("summary", {}, `${steps.length} ${steps.length === 1 ? "step" : "steps"} checked`), list)];
}
