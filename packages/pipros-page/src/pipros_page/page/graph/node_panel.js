// Everything known about one node.

import { bandwidth, h, hertz, morph, panelHead, problemLine, timeOfDay } from "../dom.js";
import { placeOf } from "../place.js";
import { rateText, staleMark } from "../stale.js";

const LEVELS = { 1: "debug", 2: "info", 4: "warn", 8: "error", 16: "fatal" };
const MAX_ENTRIES = 20;

// Fills `side`; returns a function that stops the updates.
export function nodePanel(side, name, context, onClose) {
  const body = h("div", {}, h("div", {}));
  const log = h("div", {}, h("div", {}));
  const error = problemLine("p");
  const kill = killButton(name, context, error);
  kill.hidden = !context.control;
  side.append(panelHead(name, onClose), kill, error.element, body, h("h3", {}, "Log"), log);
  let entries = [];
  const stops = [
    context.watch("node", { name }, (node) => {
      kill.hidden = !context.control || !node.known;
      morph(body.firstChild, h("div", {}, contents(node, name)));
    }),
    context.watch("console", {}, ({ history = [], entries: fresh }) => {
      entries = [...(history.length ? history : entries), ...fresh].filter((entry) => entry[1] === name).slice(-MAX_ENTRIES);
      morph(log.firstChild, h("div", {}, entries.length ? h("ul", { class: "tree" }, entries.map(logEntry))
        : h("span", { class: "key" }, "none")));
    }),
  ];
  return () => stops.forEach((stop) => stop());
}

const logEntry = ([level, , text, stamp]) => h("li", { class: `level-${level}` },
  h("span", { class: "key" }, `${timeOfDay(stamp)} ${LEVELS[level] ?? level}: `), text);

// The first click asks, the second ends the node.
function killButton(name, context, error) {
  let isSure = false;
  const button = h("button", { onblur: () => ask(false), onclick: () => {
    if (!isSure) { ask(true); return; }
    ask(false);
    error.attempt(() => context.act("kill_node", { name }));
  } }, "End node");
  function ask(isAsked) {
    isSure = isAsked;
    button.textContent = isAsked ? `Really end ${name}?` : "End node";
  }
  return button;
}

// Names of transports on the page. TCPROS is the usual one, and not shown.
const TRANSPORTS = { PIPROSLOCAL: "Unix stream" };

function contents(node, name) {
  const connection = ([from, over, to, rate, size, transport, isStale]) => {
    const ends = `${from === name ? `to ${to}` : `from ${from}`}, ${over}: `;
    const how = transport === "" || transport === "TCPROS" ? "" : `, ${TRANSPORTS[transport] ?? transport}`;
    return [h("span", {}, ends), isStale ? staleMark() : rateText(`${hertz(rate)}, ${bandwidth(size)}`), how];
  };
  return [
    node.known ? null : h("p", { class: "error" }, "The master no longer knows this node."),
    node.error ? h("p", { class: "error" }, `Does not answer: ${node.error}`) : null,
    node.wrong.map((text) => h("p", { class: "error" }, `Wrong type on ${text}.`)),
    h("dl", {}, h("dt", {}, "URI"), h("dd", {}, node.uri || "–")),
    list("Publications", node.publications.map(topicEntry)),
    list("Subscriptions", node.subscriptions.map(topicEntry)),
    list("Services", node.services.map((service) => [h("a", { href: placeOf("services", service) }, service)])),
    list("Parameters", node.parameters.map(([key, value]) => [h("span", { class: "key" }, `${key}: `), value])),
    list("Connections", node.connections.map(connection)),
  ];
}

const topicEntry = ([topic, type]) => [h("a", { href: placeOf("topics", topic) }, topic), ` ${type}`];

// Returns the text of an entry before its value, which distinguishes it from the other entries.
const textOf = (entry) => (typeof entry === "string" ? entry.replace(/: .*/s, "") : entry[0].textContent);

const list = (title, entries) => [
  h("h3", {}, title),
  entries.length ? h("ul", { class: "tree" }, entries.map((entry) => h("li", { "data-key": textOf(entry) }, entry)))
    : h("span", { class: "key" }, "none"),
];
