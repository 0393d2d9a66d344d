// The address of a tab: #tab/argument.

export const placeOf = (tab, argument = "") => `#${tab}${argument ? `/${encodeURIComponent(argument)}` : ""}`;

// The tab and the argument of the address that is open.
export function currentPlace() {
  const [tab, ...rest] = location.hash.slice(1).split("/");
  return [tab, decodeURIComponent(rest.join("/"))];
}
