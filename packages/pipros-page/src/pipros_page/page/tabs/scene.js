// Robots, sensors and maps in 3D. The module is loaded when the tab is opened, because its library is large.

export { open } from "../scene/tab.js";

// The argument is the whole scene, compressed. The bar of a panel shows nothing of it.
export const subject = () => "";
