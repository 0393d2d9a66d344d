// A note in views that act on the running system, shown while the other views show a bag.

import { h, replace } from "../dom.js";
import { playback } from "./playback.js";

// Returns the note. It is updated until `signal` is aborted.
export function runningNote(signal) {
  const element = h("div", { class: "running-note", role: "note", hidden: true });
  const show = () => {
    element.hidden = !playback.name;
    const shown = playback.isRewind ? "the past that other tabs show" : `the open bag ${playback.name}`;
    replace(element, `This view acts on the running system, not on ${shown}.`);
  };
  playback.addEventListener("change", show, { signal });
  show();
  return element;
}
