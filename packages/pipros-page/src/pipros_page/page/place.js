// Addresses of tabs: #tab/argument.

export const placeOf = (tab, argument = "") => `#${tab}${argument ? `/${encoded(argument)}` : ""}`;

// Leaves slashes, colons and the @ before moments unencoded, so that addresses are readable.
const encoded = (text) => encodeURIComponent(text).replaceAll("%2F", "/").replaceAll("%3A", ":").replaceAll("%40", "@");

// Tabs whose arguments begin with a name, and the places of names in an argument. Names may lack their leading slash.
const OF_NAMES = ["actions", "images", "publish", "reconfigure", "services", "teleop", "topics"];
const LATER_NAMES = { graph: /(?<=^(?:node|topic):)(?=[^/;])/, images: /(?<=;(?:with|over)=)(?=[^/;])/g };

// Returns the argument of a tab with the leading slashes of global names, and without those of frames.
export function completed(tab, argument) {
  if (tab === "tf") return argument.replace(/(^|>)\//g, "$1");
  const rooted = LATER_NAMES[tab] ? argument.replace(LATER_NAMES[tab], "/") : argument;
  return OF_NAMES.includes(tab) && /^[^/;]/.test(rooted) ? `/${rooted}` : rooted;
}

// Returns the tab and the argument of the current address.
export const currentPlace = () => placeIn(location.hash);

// Returns the tab and the argument of an address.
export function placeIn(address) {
  const [tab, ...rest] = address.slice(1).split("/");
  const argument = rest.join("/");
  try {
    return [tab, completed(tab, decodeURIComponent(argument))];
  } catch {
    return [tab, completed(tab, argument)]; // a user typed it without encoding
  }
}
