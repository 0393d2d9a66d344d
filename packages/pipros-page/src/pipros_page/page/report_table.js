// A view of the components on /diagnostics whose names have a prefix, such as those of fleet agents, as a table.

import { h, problemLine } from "./dom.js";
import { emptyState } from "./empty_state.js";
import { dataTable } from "./table.js";
import { toolbar } from "./toolbar.js";

// `options`: `title`, `file` of the CSV, `prefix`, `columns`, `sortBy`; `sign` and `nothing`, shown without a report.
// `keep(name, component, before)` returns what is kept of a component, or null; an aggregator puts its groups before the prefix, which
// is not in `name`. `rowsOf(name, kept, data)` returns its rows, each with a `key`.
export function reportTable(view, context, { title, file, prefix, columns, sortBy, sign, nothing }, keep, rowsOf) {
  const error = problemLine();
  const hint = emptyState(sign, nothing);
  const table = dataTable(columns, { label: title, keyOf: ({ key }) => key, sortBy });
  view.append(h("div", { class: "column" }, toolbar({ title }, h("span", { class: "spring" }), table.csvButton(file)), error.element, hint,
    h("div", { class: "scroll" }, table.element)));
  let known = new Map(); // by name
  context.watch("diagnostics", {}, (data) => {
    if (data.fresh) known = new Map();
    for (const component of data.components) {
      const start = component.name.indexOf(prefix);
      const name = component.name.slice(start + prefix.length);
      const kept = start < 0 ? null : keep(name, component, known.get(name));
      if (kept) known.set(name, kept);
    }
    error.show(data.error);
    hint.hidden = known.size > 0;
    table.show([...known].flatMap(([name, kept]) => rowsOf(name, kept, data)));
  }, error.show, { always: true });
}
