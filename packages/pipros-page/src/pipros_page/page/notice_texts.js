// Texts and addresses of the notices behind the bell.

import { placeOf } from "./place.js";

const ERRORS = "levels=8,16";

// Returns the address of what a notice is about.
export function placeOfNotice({ what, kind, name }) {
  if (kind === "frame") return placeOf("tf", name);
  if (kind === "topic") return placeOf("topics", name);
  if (kind === "component") return placeOf("diagnostics", name);
  return what === "error" ? placeOf("console", `;${ERRORS};node=${name}`) : placeOf("graph", `node:${name}`);
}

// Returns the text of the button: how many changes there are, the errors first.
export function bellText(changes, count) {
  const errors = changes.filter(({ what }) => what === "error").length;
  const counted = (number, word) => (number ? [`${number} ${word}${number === 1 ? "" : "s"}`] : []);
  const parts = [...counted(errors, "error"), ...counted(changes.length - errors, errors ? "other change" : "change")];
  const last = `${parts.join(" and ") || "No changes"} in the last minute`;
  return count ? `${last}; ${count} stale now` : last;
}
