// The form of the parameters of a dynamic_reconfigure server, with its groups, as in rqt_reconfigure.

import { h } from "./dom.js";

// `onChange(name, value)` and `onState(group, isOn)` are called for the user's changes; without `control` there are none.
export function reconfigureForm(root, { control, onChange, onState }) {
  const form = { control, onChange, onState, controls: new Map(), groups: new Map() }; // from a parameter and from a group to {show}
  return {
    element: settings(root, onChange, form),
    showValue: (name, value) => form.controls.get(name)?.show(value),
    showState: (group, isOn) => form.groups.get(group)?.show(isOn),
  };
}

function settings(group, onChange, form) {
  return h("div", { class: "group" }, group.parameters.map((parameter) => setting(parameter, onChange, form)),
    group.groups.map((inner) => below(inner, onChange, form)));
}

// Groups as in rqt_reconfigure: collapse and hide have a state, apply sends its changes together.
function below(group, onChange, form) {
  const disabled = !form.control;
  const hasState = group.type === "collapse" || group.type === "hide";
  let held = {};
  const inside = settings(group, group.type === "apply" ? (name, value) => { held[name] = value; } : onChange, form);
  if (group.type === "apply") inside.append(h("p", {}, h("button", { disabled,
    onclick: () => { for (const [name, value] of Object.entries(held)) form.onChange(name, value); held = {}; } }, "Apply")));
  const state = hasState ? h("input", { type: "checkbox", disabled, "aria-label": `State of ${group.name}`,
    onchange: () => form.onState(group.name, state.checked) }) : null;
  const details = h("details", { open: true }, h("summary", {}, group.name.replaceAll("_", " ")), inside);
  form.groups.set(group.name, { show: (isOn) => {
    if (!state) return;
    state.checked = isOn;
    details.open = isOn;
    inside.hidden = group.type === "hide" && !isOn;
  } });
  return h("div", { class: "below" }, details, state ? h("label", { class: "state" }, state, "on") : null);
}

function setting(parameter, onChange, form) {
  const { name, type, constants } = parameter;
  const disabled = !form.control;
  let isEdited = false;
  const begin = () => { isEdited = true; };
  const edit = (value) => { isEdited = false; onChange(name, value); };
  const inputs = constants.length ? choiceInput : { bool: boxInput, str: textInput }[type] ?? numberInput;
  const { parts, show } = inputs(parameter, disabled, edit, begin);
  const reset = h("button", { class: "plain reset", disabled, title: `Back to the default: ${parameter.default}`,
    "aria-label": `Reset ${name} to ${parameter.default}`, onclick: () => onChange(name, parameter.default) }, "↺");
  const row = h("div", { class: "setting" }, h("span", { class: "label", title: parameter.description }, name),
    h("span", { class: "control" }, parts), reset, h("span", { class: "about" }, parameter.description));
  form.controls.set(name, { show: (value) => {
    if (isEdited && row.contains(document.activeElement)) return; // the user is typing
    show(value);
    reset.style.visibility = value === parameter.default ? "hidden" : "";
  } });
  return row;
}

// Inputs for the kinds of parameters -----------------------------------------------------------------------------------
// Each calls `edit` with a new value, and `begin` if the user begins to type one; `show` shows a value.

function choiceInput({ name, constants }, disabled, edit) {
  const choice = h("select", { disabled, "aria-label": name, onchange: () => edit(constants[choice.selectedIndex]?.value) },
    constants.map((each) => h("option", { title: each.text }, `${each.name} (${each.value})`)),
    h("option", { disabled: true, hidden: true }));
  return { parts: [choice], show: (value) => {
    const at = constants.findIndex((each) => each.value === value);
    choice.options[constants.length].textContent = `${value} (not in the list)`;
    choice.selectedIndex = at < 0 ? constants.length : at;
  } };
}

function boxInput({ name }, disabled, edit) {
  const box = h("input", { type: "checkbox", disabled, "aria-label": name, onchange: () => edit(box.checked) });
  return { parts: [box], show: (value) => { box.checked = value; } };
}

function textInput({ name }, disabled, edit, begin) {
  const text = h("input", { disabled, "aria-label": name, spellcheck: "false", oninput: begin, onchange: () => edit(text.value) });
  return { parts: [text], show: (value) => { text.value = value; } };
}

function numberInput({ name, type, bounds }, disabled, edit, begin) {
  const number = h("input", { class: "numeric", disabled, inputmode: type === "int" ? "numeric" : "decimal", "aria-label": name,
    oninput: begin, onchange: () => edit(asNumber(number.value)) });
  const slider = bounds && bounds[1] > bounds[0] ? h("input",
    { type: "range", disabled, min: bounds[0], max: bounds[1], step: type === "int" ? 1 : "any", "aria-label": `${name}, slider`,
      oninput: () => { number.value = rounded(Number(slider.value), type, bounds); edit(Number(number.value)); } }) : null;
  const show = (value) => {
    number.value = value;
    if (slider) slider.value = value;
  };
  return { show, parts: [slider ? h("span", { class: "slide" }, h("span", { class: "bound" }, bounds[0]), slider,
    h("span", { class: "bound" }, bounds[1])) : null, number] };
}

const asNumber = (text) => (text.trim() === "" || Number.isNaN(Number(text)) ? text : Number(text));

// Rounds a slider position to a thousandth of the range, as a number that a person would type.
function rounded(value, type, [low, high]) {
  if (type === "int") return value;
  const digits = Math.max(0, 3 - Math.floor(Math.log10(high - low)));
  return Math.min(high, Math.max(low, Number(value.toFixed(Math.min(digits, 20)))));
}
