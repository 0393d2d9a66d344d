// Everything known about one node.

import { bandwidth, h, hertz, morph, panelHead } from "../dom.js";
import { placeOf } from "../place.js";

// Fills `side`; returns a function that stops the updates.
export function nodePanel(side, name, context, onClose) {
  const body = h("div", {}, h("div", {}));
  side.append(panelHead(name, onClose), body);
  return context.watch("node", { name }, (node) => morph(body.firstChild, h("div", {}, contents(node, name))));
}

function contents(node, name) {
  const connection = ([from, over, to, rate, size]) =>
    `${from === name ? `to ${to}` : `from ${from}`}, ${over}: ${hertz(rate)}, ${bandwidth(size)}`;
  return [
    node.known ? null : h("p", { class: "error" }, "The master no longer knows this node."),
    node.error ? h("p", { class: "error" }, `Does not answer: ${node.error}`) : null,
    h("dl", {}, h("dt", {}, "URI"), h("dd", {}, node.uri || "–")),
    list("Publications", node.publications.map(topicEntry)),
    list("Subscriptions", node.subscriptions.map(topicEntry)),
    list("Services", node.services),
    list("Parameters", node.parameters.map(([key, value]) => [h("span", { class: "key" }, `${key}: `), value])),
    list("Connections", node.connections.map(connection)),
  ];
}

const topicEntry = ([topic, type]) => [h("a", { href: placeOf("topics", topic) }, topic), ` ${type}`];

const list = (title, entries) => [
  h("h3", {}, title),
  entries.length ? h("ul", { class: "tree" }, entries.map((entry) => h("li", {}, entry))) : h("span", { class: "key" }, "none"),
];
