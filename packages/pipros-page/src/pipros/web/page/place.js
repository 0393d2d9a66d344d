// Addresses of tabs: #tab/argument.

export const placeOf = (tab, argument = "") => `#${tab}${argument ? `/${encoded(argument)}` : ""}`;

// Leaves slashes, colons and the @ before moments unencoded, so that addresses are readable.
const encoded = (text) => encodeURIComponent(text).replaceAll("%2F", "/").replaceAll("%3A", ":").replaceAll("%40", "@");

// Returns the tab and the argument of the current address.
export const currentPlace = () => placeIn(location.hash);

// Returns the tab and the argument of an address.
export function placeIn(address) {
  const [tab, ...rest] = address.slice(1).split("/");
  const argument = rest.join("/");
  try {
    return [tab, decodeURIComponent(argument)];
  } catch {
    return [tab, argument]; // a user typed it without encoding
  }
}
