// Parameters of dynamic_reconfigure servers, edited as in rqt_reconfigure.

import { runningNote } from "../bags/running_note.js";
import { h, problemLine, replace } from "../dom.js";
import { LOADING } from "../empty_state.js";
import { reconfigureForm } from "../reconfigure_form.js";
import { sections } from "../sections.js";
import { toolbar } from "../toolbar.js";

export function open(view, argument, context) {
  const { control } = context;
  const filter = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter servers", oninput: () => drawServers() });
  const error = problemLine();
  const list = h("ul", { class: "servers", "aria-label": "Servers" });
  const body = h("div", { class: "scroll settings" }, h("div", { class: "note" }, LOADING));
  view.append(h("div", { class: "column" }, runningNote(context.signal),
    toolbar({ title: "Reconfigure" }, sections("reconfigure"), filter, h("span", { class: "spring" }),
    h("span", { class: "key" }, control ? "" : "Start with --control to change parameters.")), error.element,
      h("div", { class: "split" }, list, body)));
  let servers = [];
  let server = "";
  let close = () => {};
  let form = null; // the form of the server, once its description has arrived
  let last = { values: {}, states: {} };
  const queue = changeQueue(context, () => server, take, (text) => { error.show(text); show(last); });

  function drawServers() {
    const wanted = filter.value.trim().toLowerCase();
    const shown = servers.filter((name) => name.toLowerCase().includes(wanted));
    replace(list, shown.length ? shown.map((name) => h("li", {}, h("button",
      { class: "plain", "aria-current": name === server ? "true" : null, onclick: () => { context.remember(name); select(name); } }, name)))
      : h("li", { class: "key" }, servers.length ? "No server matches." : "No node offers dynamic_reconfigure."));
  }

  function select(name) {
    close();
    server = name;
    form = null;
    queue.clear();
    error.show();
    replace(body, h("div", { class: "note" }, `Waiting for ${name} …`));
    drawServers();
    close = context.watch("reconfigure", { name }, (data) => {
      if (data.groups) drawForm(data.groups);
      if (data.values) show(data);
    }, error.show);
  }

  function drawForm(root) {
    form = reconfigureForm(root, { control, onChange: (name, value) => queue.change("changes", name, value),
      onState: (name, isOn) => queue.change("states", name, isOn) });
    replace(body, h("h2", {}, server), form.element);
  }

  function take(data) {
    error.show();
    show(data);
  }

  function show(data) {
    last = { values: { ...last.values, ...data.values }, states: { ...last.states, ...data.states } };
    for (const [name, value] of Object.entries(data.values)) if (!queue.isChanging("changes", name)) form?.showValue(name, value);
    for (const [name, state] of Object.entries(data.states)) if (!queue.isChanging("states", name)) form?.showState(name, state);
  }

  const gone = () => `${server} is no longer offered.`;
  context.watch("reconfigurable", {}, (data) => {
    const isFirst = !servers.length;
    if (servers.join() !== data.servers.join() || isFirst) {
      servers = data.servers;
      drawServers();
    }
    if (server) error.show(servers.includes(server) ? error.element.textContent === gone() ? "" : error.element.textContent : gone());
    else if (argument) select(argument);
    else if (servers.length) select(servers[0]);
    else replace(body);
  }, error.show);
  return { go: (name) => { if (name) select(name); } };
}

const nothing = () => ({ changes: {}, states: {} });

// The user's changes for the server that `serverOf` returns. One call at a time: further changes are sent with the next call.
// `onAnswer` and `onProblem` are called if the server is still the same.
function changeQueue(context, serverOf, onAnswer, onProblem) {
  let pending = nothing();
  let sending = nothing(); // meanwhile, older values from the server must not undo these changes on the page
  let isSending = false;

  async function send() {
    if (isSending) return;
    isSending = true;
    while (Object.keys(pending.changes).length || Object.keys(pending.states).length) {
      const asked = { name: serverOf(), ...pending };
      sending = pending;
      pending = nothing();
      try {
        const answer = await context.act("set_reconfigured", asked);
        sending = nothing();
        if (asked.name === serverOf()) onAnswer(answer);
      } catch (problem) {
        sending = nothing();
        if (asked.name === serverOf()) onProblem(problem.message);
      }
    }
    isSending = false;
  }

  return {
    change(kind, name, value) {
      pending[kind][name] = value;
      send();
    },
    clear() { pending = nothing(); },
    isChanging: (kind, name) => name in pending[kind] || name in sending[kind],
  };
}
