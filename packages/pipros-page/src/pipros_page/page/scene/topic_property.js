// The property that names the topic of a display.

import { DISPLAYS } from "./schema.js";

// Returns the definition of the property of a kind of display; undefined if it has no topic.
export const topicProperty = (kind) => DISPLAYS[kind]?.find((each) => each[1] === "topic");

// Returns the topic of a display that is switched on; empty if it has none.
export function topicOf(display) {
  const property = topicProperty(display.config.Class ?? "");
  return display.isOn && property ? display.scene.topicName(display.get(property[0])) : "";
}
