// The lists of the Images tab: the topic, a second one, how the pair is shown, and what is drawn over the image.

import { h, replace } from "./dom.js";
import { BESIDE, DIFFERENCE, isOverlay } from "./image_address.js";
import { unsupportedTransport } from "./image_colours.js";

const TYPES = ["sensor_msgs/Image", "sensor_msgs/CompressedImage"];

// Returns the names of the topics with images, including those that are not decoded.
export const imageTopics = (topics) => topics.filter((each) => TYPES.includes(each.type) || unsupportedTransport(each))
  .map(({ name }) => name);

// `onChoose(wanted)` is called with what the user chose; see image_address.js. Returns {controls, draw(topics, shown)}.
export function imageChoices(onChoose) {
  const choose = () => onChoose({ topic: choice.value, other: second.value === choice.value ? "" : second.value,
    isDifference: show.value === DIFFERENCE, overlay: overlay.value });
  const [choice, second, show, overlay] = ["Topic", "Pair with", "Show the pair as", "Overlay"].map((label) =>
    h("select", { "aria-label": label, onchange: choose }));
  const pairing = h("span", { class: "choices" }, h("label", {}, "with", second), h("label", {}, show));
  const drawn = h("label", {}, "over it", overlay);
  replace(show, [BESIDE, DIFFERENCE].map((each) => h("option", { value: each }, each)));

  function draw(topics, shown) {
    const named = (isWanted) => topics.filter(isWanted).map(({ name }) => name);
    const images = named(({ type }) => TYPES.includes(type));
    fill(choice, imageTopics(topics), shown.topic, shown.topic ? null : "Choose a topic");
    fill(second, images.filter((each) => each !== shown.topic), shown.other, "no other");
    fill(overlay, named(({ type }) => isOverlay(type)), shown.overlay, "nothing");
    show.value = shown.isDifference ? DIFFERENCE : BESIDE;
    show.hidden = !shown.other;
    pairing.hidden = !shown.topic || (images.length < 2 && !shown.other);
    drawn.hidden = !shown.topic || overlay.options.length < 2;
  }

  return { controls: [choice, pairing, drawn], draw };
}

// Offers names; `none` is the text for no choice, null if there must be one.
function fill(choice, names, chosen, none) {
  const all = [...new Set([...(chosen ? [chosen] : []), ...names])].sort().map((name) => [name, name]);
  if (none !== null) all.unshift(["", none]);
  if ([...choice.options].map((option) => option.text).join() !== all.map(([, text]) => text).join())
    replace(choice, all.map(([value, text]) => h("option", { value }, text)));
  choice.value = chosen;
}
