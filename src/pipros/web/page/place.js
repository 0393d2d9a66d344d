// Addresses of tabs: #tab/argument.

export const placeOf = (tab, argument = "") => `#${tab}${argument ? `/${encoded(argument)}` : ""}`;

// Keeps the slashes and colons of names readable.
const encoded = (text) => encodeURIComponent(text).replaceAll("%2F", "/").replaceAll("%3A", ":");

// Returns the tab and the argument of the current address.
export function currentPlace() {
  const [tab, ...rest] = location.hash.slice(1).split("/");
  const argument = rest.join("/");
  try {
    return [tab, decodeURIComponent(argument)];
  } catch {
    return [tab, argument]; // not encoded: somebody typed it
  }
}
