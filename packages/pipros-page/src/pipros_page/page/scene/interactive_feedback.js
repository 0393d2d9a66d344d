// The feedback on an interactive marker, as rviz sends it.

import { withoutSlash } from "./display.js";
import { composed, inverted } from "./pose.js";

// Returns feedback on a control, in `fixedFrame`, or in the marker's frame if `fixedFrame` is null.
export function feedbackOf(event, entry, control, fixedFrame, point, menuEntry) {
  const isLocked = fixedFrame === null;
  const shown = isLocked ? entry.pose : composed(entry.frame, entry.pose);
  const at = point ? (isLocked ? composed(inverted(entry.frame), [point.x, point.y, point.z, 0, 0, 0, 1]) : point.toArray()) : [0, 0, 0];
  return {
    header: { frame_id: isLocked ? withoutSlash(entry.header.frame_id) : fixedFrame },
    marker_name: entry.message.name,
    control_name: control.name,
    event_type: event,
    pose: { position: { x: shown[0], y: shown[1], z: shown[2] }, orientation: { x: shown[3], y: shown[4], z: shown[5], w: shown[6] } },
    menu_entry_id: menuEntry,
    mouse_point: { x: at[0], y: at[1], z: at[2] },
    mouse_point_valid: Boolean(point),
  };
}
