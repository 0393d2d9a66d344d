// Parameters of dynamic_reconfigure servers, edited as in rqt_reconfigure.

import { h, replace } from "../dom.js";
import { sections } from "../sections.js";

export function open(view, argument, context) {
  const { control } = context;
  const filter = h("input", { type: "search", placeholder: "Filter", "aria-label": "Filter servers", oninput: () => drawServers() });
  const error = h("div", { class: "error", role: "alert" });
  const list = h("ul", { class: "servers", "aria-label": "Servers" });
  const body = h("div", { class: "scroll settings" });
  view.append(h("div", { class: "column" }, h("div", { class: "bar" }, sections("reconfigure"), filter, h("span", { class: "spring" }),
    h("span", { class: "key" }, control ? "" : "Start with --control to change parameters.")), error,
      h("div", { class: "split" }, list, body)));
  let servers = [];
  let server = "";
  let close = () => {};
  let controls = new Map(); // parameter to {show}
  let groups = new Map(); // group to {show}
  let last = { values: {}, states: {} };
  let pending = { changes: {}, states: {} };
  let sending = { changes: {}, states: {} }; // meanwhile, older values from the server must not undo these changes on the page
  let isSending = false;

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
    controls = new Map();
    groups = new Map();
    pending = { changes: {}, states: {} };
    replace(error, "");
    replace(body, h("div", { class: "note" }, `Waiting for ${name} …`));
    drawServers();
    close = context.watch("reconfigure", { name }, (data) => {
      if (data.groups) drawSettings(data.groups);
      if (data.values) take(data);
    }, (problem) => replace(error, problem));
  }

  function drawSettings(root) {
    controls = new Map();
    groups = new Map();
    replace(body, h("h2", {}, server), settings(root, (name, value) => change(name, value)));
  }

  function settings(group, onChange) {
    return h("div", { class: "group" }, group.parameters.map((parameter) => setting(parameter, onChange)),
      group.groups.map((inner) => below(inner, onChange)));
  }

  // Groups as in rqt_reconfigure: collapse and hide have a state, apply sends its changes together.
  function below(group, onChange) {
    const hasState = group.type === "collapse" || group.type === "hide";
    let held = {};
    const inside = settings(group, group.type === "apply" ? (name, value) => { held[name] = value; } : onChange);
    if (group.type === "apply") inside.append(h("p", {}, h("button", { disabled: !control,
      onclick: () => { for (const [name, value] of Object.entries(held)) change(name, value); held = {}; } }, "Apply")));
    const state = hasState ? h("input", { type: "checkbox", disabled: !control, "aria-label": `State of ${group.name}`,
      onchange: () => { pending.states[group.name] = state.checked; send(); } }) : null;
    const details = h("details", { open: true }, h("summary", {}, group.name.replaceAll("_", " ")), inside);
    groups.set(group.name, { show: (isOn) => {
      if (!state) return;
      state.checked = isOn;
      details.open = isOn;
      inside.hidden = group.type === "hide" && !isOn;
    } });
    return h("div", { class: "below" }, details, state ? h("label", { class: "state" }, state, "on") : null);
  }

  function setting(parameter, onChange) {
    const { name, type, constants, bounds } = parameter;
    const disabled = !control;
    let shown;
    let isEdited = false;
    const edit = (value) => { isEdited = false; onChange(name, value); };
    let parts;
    if (constants.length) {
      const choice = h("select", { disabled, "aria-label": name, onchange: () => edit(constants[choice.selectedIndex]?.value) },
        constants.map((each) => h("option", { title: each.text }, `${each.name} (${each.value})`)));
      shown = (value) => {
        choice.selectedIndex = constants.findIndex((each) => each.value === value);
      };
      parts = [choice];
    } else if (type === "bool") {
      const box = h("input", { type: "checkbox", disabled, "aria-label": name, onchange: () => edit(box.checked) });
      shown = (value) => { box.checked = value; };
      parts = [box];
    } else if (type === "str") {
      const text = h("input", { disabled, "aria-label": name, spellcheck: "false", oninput: () => { isEdited = true; },
        onchange: () => edit(text.value) });
      shown = (value) => { text.value = value; };
      parts = [text];
    } else {
      const number = h("input", { class: "numeric", disabled, inputmode: type === "int" ? "numeric" : "decimal", "aria-label": name,
        oninput: () => { isEdited = true; }, onchange: () => edit(asNumber(number.value)) });
      const slider = bounds && bounds[1] > bounds[0] ? h("input",
        { type: "range", disabled, min: bounds[0], max: bounds[1], step: type === "int" ? 1 : "any", "aria-label": `${name}, slider`,
        oninput: () => { number.value = rounded(Number(slider.value), type, bounds); edit(Number(number.value)); } }) : null;
      shown = (value) => {
        number.value = value;
        if (slider) slider.value = value;
      };
      parts = [slider ? h("span", { class: "slide" }, h("span", { class: "bound" }, bounds[0]), slider,
        h("span", { class: "bound" }, bounds[1])) : null, number];
    }
    const reset = h("button", { class: "plain reset", disabled, title: `Back to the default: ${parameter.default}`,
      "aria-label": `Reset ${name} to ${parameter.default}`, onclick: () => onChange(name, parameter.default) }, "↺");
    const row = h("div", { class: "setting" }, h("span", { class: "label", title: parameter.description }, name),
      h("span", { class: "control" }, parts), reset, h("span", { class: "about" }, parameter.description));
    controls.set(name, { show: (value) => {
      if (isEdited && row.contains(document.activeElement)) return; // the user is typing
      shown(value);
      reset.style.visibility = value === parameter.default ? "hidden" : "";
    } });
    return row;
  }

  function change(name, value) {
    pending.changes[name] = value;
    send();
  }

  // One call at a time. Further changes are sent with the next call.
  async function send() {
    if (isSending) return;
    isSending = true;
    while (Object.keys(pending.changes).length || Object.keys(pending.states).length) {
      const asked = { name: server, ...pending };
      sending = pending;
      pending = { changes: {}, states: {} };
      try {
        const answer = await context.act("set_reconfigured", asked);
        sending = { changes: {}, states: {} };
        if (asked.name === server) { replace(error, ""); take(answer); }
      } catch (problem) {
        sending = { changes: {}, states: {} };
        if (asked.name === server) { replace(error, problem.message); take(last); }
      }
    }
    isSending = false;
  }

  function take(data) {
    last = { values: { ...last.values, ...data.values }, states: { ...last.states, ...data.states } };
    const isChanging = (kind, name) => name in pending[kind] || name in sending[kind];
    for (const [name, value] of Object.entries(data.values)) if (!isChanging("changes", name)) controls.get(name)?.show(value);
    for (const [name, state] of Object.entries(data.states)) if (!isChanging("states", name)) groups.get(name)?.show(state);
  }

  const gone = () => `${server} is not offered any more.`;
  context.watch("reconfigurable", {}, (data) => {
    const isFirst = !servers.length;
    if (servers.join() !== data.servers.join() || isFirst) {
      servers = data.servers;
      drawServers();
    }
    if (server) replace(error, servers.includes(server) ? error.textContent === gone() ? "" : error.textContent : gone());
    else if (argument) select(argument);
    else if (servers.length) select(servers[0]);
  }, (problem) => replace(error, problem));
  return { go: (name) => { if (name) select(name); } };
}

const asNumber = (text) => (text.trim() === "" || Number.isNaN(Number(text)) ? text : Number(text));

// Rounds a slider position to a thousandth of the range, as a number that a person would type.
function rounded(value, type, [low, high]) {
  if (type === "int") return value;
  const digits = Math.max(0, 3 - Math.floor(Math.log10(high - low)));
  return Math.min(high, Math.max(low, Number(value.toFixed(Math.min(digits, 20)))));
}
