// Robots, sensors and maps in 3D: loaded when it is opened, because its library is large.

export { open } from "../scene/tab.js";
