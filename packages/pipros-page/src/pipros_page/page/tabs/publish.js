// A form to publish messages, once, or at a rate as long as this page is open in the browser.

import { runningNote } from "../bags/running_note.js";
import { h, problemLine, replace, uniqueId } from "../dom.js";
import { publisherList, startPublisher } from "../publishers.js";
import { toolbar } from "../toolbar.js";
import { yaml } from "./services.js";

export function open(view, argument, context) {
  const { control } = context;
  const topic = h("input", { placeholder: "/topic", value: argument, "aria-label": "Topic", spellcheck: "false",
    list: uniqueId("publish-topics"), onchange: () => chosen() });
  const type = h("input", { placeholder: "std_msgs/String", "aria-label": "Type", spellcheck: "false", onchange: () => defaults() });
  const rate = h("input", { type: "number", value: 1, min: 0, max: 1000, step: "any", required: true, "aria-label": "Rate in hertz",
    title: "0 publishes once" });
  const message = h("textarea", { rows: 12, class: "mono", "aria-label": "Message in YAML", spellcheck: "false",
    placeholder: "The message in YAML. A topic or a type fills in its fields." });
  const topics = h("datalist", { id: topic.getAttribute("list") });
  const error = problemLine();
  const list = publisherList(context.signal);
  const head = [runningNote(context.signal), toolbar({ title: "Publish" }), error.element];
  view.append(h("div", { class: "column" }, head, h("div", { class: "scroll form publishing" },
    control ? null : h("p", { class: "note" }, "This page is read-only. Start it with --control to publish."),
    h("label", {}, "Topic", topic), topics, h("label", {}, "Type", type), h("label", {}, "Rate in Hz", rate), message,
    h("p", {}, h("button", { disabled: !control, title: "Control+Enter", "aria-keyshortcuts": "Control+Enter", onclick: () => publish() },
      "Publish"), h("span", { class: "key" },
      "  With a rate of 0, the message is sent once, and to later subscribers until stopped. Closing the page stops publishing.")),
    h("p", { class: "key" }, "Texts that begin with = are expressions: data: =sin(t), where t is the time in seconds and i counts the " +
      "messages from 0."), list)));
  let known = [];
  const ask = context.newest();
  context.watch("running_topics", {}, (data) => {
    known = data.topics;
    replace(topics, known.map((each) => h("option", { value: each.name })));
    if (!type.value && !message.value) chosen(); // the topic was typed before
  });

  function chosen() {
    const found = known.find((each) => each.name === topic.value);
    if (found && found.type !== "*" && (found.type !== type.value || !message.value)) { type.value = found.type; defaults(); }
  }

  const defaults = () => error.attempt(async () => {
    const before = message.value;
    const template = yaml(await ask("message", { type: type.value }));
    if (message.value !== before) return; // the user has begun to type
    message.value = template;
    if (document.activeElement === message) message.select();
  });

  function publish() {
    if (!rate.reportValidity()) return;
    const args = { name: topic.value, type: type.value, message: message.value, rate: Number(rate.value) };
    error.show();
    startPublisher(args, error.show);
  }

  return { go: (name) => { if (name) { topic.value = name; chosen(); } } };
}
