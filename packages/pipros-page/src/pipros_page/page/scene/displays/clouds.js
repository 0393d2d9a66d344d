// Point clouds and laser scans.

import { cloudArrays } from "../cloud_arrays.js";
import { fieldsFor } from "../cloud_colours.js";
import { CloudDecoder } from "../cloud_decoder.js";
import { Display, withoutSlash } from "../display.js";
import { TransformError } from "../frames.js";
import { points, refilled } from "../points.js";
import { interpolated, transformed, vectorText } from "../pose.js";
import { clear, dispose, place } from "../shapes.js";

const MAX_KEPT = 2000000; // maximum number of points of all clouds in a display with a decay time
const TEXT = new TextDecoder();

export class Cloud extends Display {
  begin() {
    this.kept = []; // {object, arrival (ns), count, columns, pose, look}
  }

  reset() {
    super.reset();
    this.kept = [];
  }

  // Shows columns at a pose.
  show(columns, pose) {
    this.put(cloudArrays(columns, this.options(pose)), pose);
  }

  // Returns the options of `cloudArrays`.
  options(pose) {
    return {
      transformer: this.get("Color Transformer"),
      channel: this.get("Channel Name"),
      rainbow: this.get("Use rainbow"),
      invert: this.get("Invert Rainbow"),
      minColor: this.get("Min Color"),
      maxColor: this.get("Max Color"),
      autoBounds: this.get("Autocompute Intensity Bounds"),
      bounds: [this.get("Min Intensity"), this.get("Max Intensity")],
      colour: this.get("Color"),
      autoAxis: this.get("Autocompute Value Bounds"),
      axisBounds: [this.get("Autocompute Value Bounds", "Min Value"), this.get("Autocompute Value Bounds", "Max Value")],
      axis: this.get("Axis"),
      isFixed: this.get("Use Fixed Frame"),
      pose,
    };
  }

  // Draws what `cloudArrays` returned.
  put({ count, columns, positions, tints, hasAlpha }, pose) {
    const style = this.get("Style");
    const size = style === "Points" ? this.get("Size (Pixels)") : this.get("Size (m)");
    const look = [style, size, this.get("Alpha"), hasAlpha, style === "Points" ? 0 : this.sizePerDepth()];
    const isKept = this.get("Decay Time") > 0;
    const object = (isKept ? null : this.redrawn(positions, tints, look.join())) ?? points(style, positions, tints, ...look.slice(1));
    place(object, pose);
    if (!isKept) {
      clear(this.root);
      this.kept = [];
    }
    this.root.add(object);
    this.kept.push({ object, arrival: this.scene.now(), count, columns, pose, look: look.join() });
    this.scene.invalidate();
  }

  // Returns an object with the buffers of the last cloud, filled with another cloud of the same size, so that no memory on the
  // graphics card is allocated again; null if that is not possible.
  redrawn(positions, tints, look) {
    const last = this.kept.length === 1 ? this.kept[0] : null;
    if (!last?.object.isPoints || last.look !== look || last.count !== positions.length / 3) return null;
    this.root.remove(last.object); // but keep its buffers
    return refilled(last.object, positions, tints);
  }

  load() {
    return `${this.kept.reduce((sum, { count }) => sum + count, 0).toLocaleString("en-GB")} points`;
  }

  selectables() {
    if (!this.get("Selectable")) return [];
    const radius = this.get("Style") === "Points" ? 0 : this.get("Size (m)") / 2;
    return (this.kept ?? []).map(({ object, count, columns, pose }) => ({ label: "Point", object, count, radius, describe: (index) => {
      const at = transformed(pose, ["x", "y", "z"].map((axis) => columns.get(axis)[index]));
      const others = [...columns].filter(([name]) => !["x", "y", "z"].includes(name));
      return [["Position", vectorText(at)], ...others.map(([name, values]) => [name, valueText(name, values[index])])];
    } }));
  }

  // Returns the size of points per metre of their z, or 0 if all have the same size.
  sizePerDepth() {
    return 0;
  }

  frame() {
    const decay = this.get("Decay Time");
    if (!(decay > 0)) return;
    const now = this.scene.now();
    let total = this.kept.reduce((sum, { count }) => sum + count, 0);
    while (this.kept.length > 1 && (Number(now - this.kept[0].arrival) / 1e9 > decay || total > MAX_KEPT)) {
      const [{ object, count }] = this.kept.splice(0, 1);
      total -= count;
      this.root.remove(object);
      dispose(object);
    }
    if (this.kept.length === 1 && Number(now - this.kept[0].arrival) / 1e9 > decay) {
      clear(this.root);
      this.kept = [];
    }
  }
}

const valueText = (name, value) => (name === "rgb" || name === "rgba"
  ? [value >> 16, value >> 8, value].map((part) => part & 255).join("; ") : String(value));

export class PointCloud2 extends Cloud {
  begin() {
    super.begin();
    this.topic = "";
    this.limit = 0;
    this.points = null; // {shown, total} of the newest cloud
    this.decoder = new CloudDecoder((arrays, job) => this.put(arrays, job.pose), (text) => this.setStatus("Message", "error", text));
    const name = this.scene.topicName(this.get("Topic"));
    this.received = 0;
    if (!name) {
      this.setStatus("Topic", "error", "Error subscribing: Empty topic name");
      return;
    }
    this.setStatus("Topic", "warning", "No messages received");
    this.topic = name;
    this.scene.hasNewClouds = true;
    this.scene.invalidate();
  }

  end() {
    this.stopListening?.();
    this.stopListening = null;
    this.decoder?.end();
    this.limit = 0;
    this.points = null;
    this.scene.hasNewClouds = true;
  }

  // Subscribes to the cloud with at most `limit` points.
  takeShare(limit) {
    if (!this.topic || limit === this.limit) return;
    this.stopListening?.();
    this.limit = limit;
    const fields = fieldsFor(this.get("Color Transformer"), this.get("Channel Name"));
    this.stopListening = this.scene.context.watch("scene_cloud", { name: this.topic, limit, fields }, (data) => this.take(data),
      (text) => text && this.setStatus("Topic", "error", text));
  }

  take(data) {
    const all = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
    const end = all.indexOf(10);
    const head = JSON.parse(TEXT.decode(all.subarray(0, end)));
    this.scene.figures.bytes += data.byteLength;
    this.sender = head.from;
    this.countMessage();
    if (head.problem) {
      this.setStatus("Message", "error", head.problem);
      return;
    }
    this.dropStatus("Message");
    this.points = { shown: Math.ceil(head.count / head.step), total: head.count };
    this.setStatus("Points", "ok", head.step > 1 ? `Showing 1 in ${head.step} of ${head.count} points` : `Showing ${head.count} points`);
    const columns = all.subarray(end + 1);
    const header = { frame_id: head.frame, stamp: BigInt(head.stamp[0]) * 1000000000n + BigInt(head.stamp[1]) };
    if (!this.scene.isLate({ header })) this.whenPlaced({ header }, (_, pose) => this.decode(head, columns, pose));
  }

  decode(head, data, pose) {
    this.decoder.decode({ head, data, options: this.options(pose), pose });
  }

  missing() {
    return this.decoder?.current ? [`the cloud on [${this.topic}] is not decoded yet`] : super.missing();
  }

  reset() {
    this.decoder?.forget();
    super.reset();
  }
}

export class LaserScan extends Cloud {
  begin() {
    super.begin();
    this.subscribe("Topic", (scan) => {
      const span = BigInt(Math.round(Math.max(0, scan.time_increment * (scan.ranges.length - 1)) * 1e9)) || 0n;
      if (span > 1000000000n) this.setStatus("Scan Time", "warning",
        `According to time_increment, the laser scan takes ${(Number(span) / 1e9).toFixed(3)} s, which is longer than a second.`);
      this.whenPlaced(scan, (message, pose) => this.project(message, pose, span), (message) => message.header.stamp + span);
    });
  }

  // Projects each ray with the pose at its own time. The points are in the fixed frame.
  project(scan, from, span) {
    const { ranges, intensities } = scan;
    let to = from;
    if (span) {
      try {
        to = this.scene.poseOf(withoutSlash(scan.header.frame_id), scan.header.stamp + span);
      } catch (error) {
        if (!(error instanceof TransformError)) throw error;
      }
    }
    const found = [];
    const values = [];
    for (let i = 0; i < ranges.length; i += 1) {
      const range = ranges[i];
      if (!(range >= scan.range_min && range < scan.range_max)) continue;
      const angle = scan.angle_min + i * scan.angle_increment;
      const pose = span ? interpolated(from, to, ranges.length > 1 ? i / (ranges.length - 1) : 0) : from;
      found.push(transformed(pose, [range * Math.cos(angle), range * Math.sin(angle), 0]));
      values.push(intensities[i] ?? 0);
    }
    const columns = new Map(["x", "y", "z"].map((name, axis) => [name, Float32Array.from(found, (point) => point[axis])]));
    if (intensities.length) columns.set("intensity", Float32Array.from(values));
    this.show(columns, [0, 0, 0, 0, 0, 0, 1]);
  }
}

// A sensor's number, in the message's field with the name of the channel: one point at the sensor.
export class Spot extends Cloud {
  begin() {
    super.begin();
    const [[, , channel]] = this.properties.find(["Channel Name"]);
    this.subscribe("Topic", (message) => this.whenPlaced(message, (each, pose) =>
      this.show(new Map([["x", [0]], ["y", [0]], ["z", [0]], [channel, [each[channel]]]]), pose)));
  }
}
