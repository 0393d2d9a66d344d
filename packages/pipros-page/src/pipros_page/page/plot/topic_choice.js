// The topics that can be plotted: completions for the field, and buttons while there is no curve.

import { h, replace, uniqueId } from "../dom.js";

const MAX_OFFERED = 60;
const WITHOUT_NUMBERS = new Set(["actionlib_msgs/GoalID", "rosgraph_msgs/Log", "std_msgs/Empty", "std_msgs/String",
  "tf2_msgs/TFMessage"]); // without numbers that are worth a curve

// `onChoose(topic)` is called when a button is pressed. Returns {names, buttons}.
export function topicChoice(context, onChoose) {
  const names = h("datalist", { id: uniqueId("plot-topics") });
  const buttons = h("div", { class: "choice", role: "group", "aria-label": "Topics" });
  context.watch("topics", {}, ({ topics }) => {
    if (names.childElementCount === topics.length) return;
    replace(names, topics.map((topic) => h("option", { value: topic.name })));
    const shown = topics.filter(({ type }) => !WITHOUT_NUMBERS.has(type)).slice(0, MAX_OFFERED);
    replace(buttons, shown.map(({ name }) => h("button", { title: `Plot numbers of ${name}`, onclick: () => onChoose(name) }, name)));
  });
  return { names, buttons };
}
