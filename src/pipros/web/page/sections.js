// The two sections of the Parameters tab.

import { h } from "./dom.js";
import { placeOf } from "./place.js";

const SECTIONS = [["params", "All"], ["reconfigure", "Reconfigure"]];

export const sections = (open) => h("nav", { class: "sections", "aria-label": "Parameters" }, SECTIONS.map(([tab, title]) => h("a", { href: placeOf(tab), "aria-current": tab === open ? "page" : null }, title)));
