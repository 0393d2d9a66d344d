// Records topics of the running system into the bag folder: a form, and the state of the recording for all browsers.

import { bytes, h, problemLine, replace } from "../dom.js";
import { textFilter } from "../text_filter.js";
import { elapsed } from "./playback.js";

// Returns an element for the tab, hidden until the tab shows it. `open(name)` opens the finished bag.
export function recordingPanel(context, open) {
  const { control } = context;
  const name = h("input", { size: 24, placeholder: "date and time", "aria-label": "Name of the recording", spellcheck: "false" });
  const megabytes = h("input", { type: "number", min: 0, step: "any", placeholder: "none", "aria-label": "Largest size in MB" });
  const seconds = h("input", { type: "number", min: 0, step: "any", placeholder: "none", "aria-label": "Longest time in seconds" });
  const all = h("input", { type: "checkbox", checked: true, onchange: () => showTopics() });
  const filter = h("input", { size: 18, placeholder: "filter", "aria-label": "Filter the topics to record", spellcheck: "false",
    oninput: () => showTopics() });
  const list = h("div", { class: "topics-to-record", role: "group", "aria-label": "Topics to record" });
  const error = problemLine("p");
  const free = h("span", { class: "pale" });
  const start = h("button", { disabled: true, onclick: () => record() }, "Start recording");
  const state = h("p", { class: "recording", role: "status", hidden: true });
  const text = h("span", {});
  const stop = h("button", { disabled: !control, onclick: () => act("stop_recording") }, "Stop recording");
  const show = h("button", { onclick: () => open(shown.name) }, "Open");
  state.append(text, stop, show);
  const form = h("details", {}, h("summary", {}, "Record"),
    h("div", { class: "form" }, control ? null : h("p", { class: "note" }, "This page is read-only. Start it with --control to record."),
      h("label", {}, "Name", name), h("label", {}, "At most (MB)", megabytes), h("label", {}, "At most (s)", seconds),
      h("div", { class: "bar" }, h("label", {}, all, "All topics, including later ones"), filter), list, error.element,
        h("div", { class: "bar" }, start, free)));
  const element = h("div", { class: "recorder", hidden: true }, state, form);
  const chosen = new Set();
  let topics = [];
  let shown = null; // the recording that is shown

  function showTopics() {
    filter.hidden = list.hidden = all.checked;
    const wanted = textFilter(filter.value);
    const rows = topics.filter((topic) => chosen.has(topic) || wanted(topic));
    if (list.dataset.shown === rows.join()) return;
    list.dataset.shown = rows.join();
    replace(list, rows.map((topic) => h("label", {}, h("input", { type: "checkbox", checked: chosen.has(topic), "data-topic": topic,
      onchange: ({ target }) => (target.checked ? chosen.add(topic) : chosen.delete(topic)) }), topic)));
  }

  async function act(action, args = {}) {
    const isDone = await error.attempt(() => context.act(action, args));
    form.open ||= !isDone;
    return isDone;
  }

  async function record() {
    if (!all.checked && !chosen.size) { error.show("Choose topics, or check All topics."); return; }
    if (![megabytes, seconds].every((each) => each.reportValidity())) return;
    const limits = { size: Number(megabytes.value) * 1e6, seconds: Number(seconds.value) };
    if (!await act("record", { name: name.value.trim(), topics: all.checked ? [] : [...chosen], ...limits })) return;
    name.value = "";
    form.open = false;
  }

  context.watch("recording", {}, (data) => {
    if (data.spare === null) return; // there is no folder
    topics = data.topics;
    showTopics();
    shown = data.recording;
    const isRunning = Boolean(shown?.is_running);
    start.disabled = !control || isRunning;
    replace(free, `${bytes(data.spare)} can be recorded.`);
    state.hidden = !shown;
    if (!shown) return;
    state.classList.toggle("running", isRunning);
    stop.hidden = !isRunning;
    show.hidden = isRunning || !shown.size;
    const figures = [`${shown.topics} ${shown.topics === 1 ? "topic" : "topics"}`, `${shown.messages} messages`,
      `${bytes(shown.size)} on disk`, elapsed(shown.seconds)];
    if (isRunning) figures.push(`${bytes(data.spare)} left`);
    text.textContent = `${isRunning ? "● Recording" : "Recorded"} ${shown.name}: ` +
      `${figures.join(", ")}${shown.problem ? `. ${shown.problem}` : ""}`;
  }, error.show);

  return element;
}
