// Addresses of tabs: #tab/argument.

export const placeOf = (tab, argument = "") => `#${tab}${argument ? `/${encodeURIComponent(argument)}` : ""}`;

// Returns the tab and the argument of the current address.
export function currentPlace() {
  const [tab, ...rest] = location.hash.slice(1).split("/");
  return [tab, decodeURIComponent(rest.join("/"))];
}
