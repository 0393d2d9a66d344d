// What the Images tab shows, as text for addresses: /left/image;with=/right/image;show=difference;over=/detections

const OPTION = /;(?=(?:with|show|over)=)/;
export const BESIDE = "side by side";
export const DIFFERENCE = "difference";
const DRAWN = /(^|\/)Detection2DArray$|^visualization_msgs\/Marker(Array)?$/;

// Whether messages of a type can be drawn over images.
export const isOverlay = (type) => DRAWN.test(type ?? "");

// Returns {topic, other, isDifference, overlay}; empty texts for what is not shown.
export function parsedImages(text) {
  const [topic, ...options] = text.split(OPTION);
  const { with: other = "", show = "", over: overlay = "" } = Object.fromEntries(options.map((each) =>
    [each.slice(0, each.indexOf("=")), each.slice(each.indexOf("=") + 1)]));
  return { topic, other, isDifference: other !== "" && show === DIFFERENCE, overlay };
}

export const imagesText = ({ topic, other, isDifference, overlay }) => [topic, other && `with=${other}`, other && isDifference
  ? `show=${DIFFERENCE}` : "", overlay && `over=${overlay}`].filter((each, index) => !index || each).join(";");
