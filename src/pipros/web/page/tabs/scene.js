// Robots, sensors and maps in 3D. The module is loaded when the tab is opened, because its library is large.

export { open } from "../scene/tab.js";
