// Images: one topic, or pairs of two whose timestamps are about equal, beside one another or as their difference; and detections or
// markers over them.

import { playback } from "../bags/playback.js";
import { bandwidth, h, hertz, problemLine, replace } from "../dom.js";
import { emptyState } from "../empty_state.js";
import { imagesText, parsedImages } from "../image_address.js";
import { imageChoices, imageTopics } from "../image_choices.js";
import { unsupportedTransport } from "../image_colours.js";
import { headOf } from "../image_drawing.js";
import { imageStage } from "../image_stage.js";
import { rateText } from "../stale.js";
import { toolbar } from "../toolbar.js";
import { whyNoData } from "../why_no_data.js";

const CHOOSE = "Choose a topic";

export function open(view, argument, context) {
  const choices = imageChoices((wanted) => choose(wanted));
  const figures = h("span", {});
  const error = problemLine();
  const hint = emptyState("▣");
  const why = whyNoData(context);
  const [stage, beside] = [imageStage(), imageStage("Second image")];
  const pictures = h("div", { class: "split" }, stage.area);
  stage.zoom.onView = beside.zoom.follow;
  beside.zoom.onView = stage.zoom.follow;
  view.append(h("div", { class: "column" }, toolbar({ title: "Images" }, choices.controls, figures, stage.pixel,
    h("span", { class: "spring" }), stage.controls), error.element, hint, why.element, pictures));
  let shown = parsedImages(argument);
  let topics = [];
  const stops = [];

  context.watch("topics", {}, (data) => {
    ({ topics } = data);
    const found = topics.find((each) => each.name === shown.topic);
    const names = imageTopics(topics);
    if (found && unsupportedTransport(found)) refuse(unsupportedTransport(found));
    if (!shown.topic && names.length === 1) look({ ...shown, topic: names[0] });
    if (!shown.topic) offer(hint, names, (name) => choose({ ...shown, topic: name }));
    drawChoices();
  });

  function drawChoices() {
    choices.draw(topics, shown);
    const isBeside = shown.other !== "" && !shown.isDifference;
    if (!isBeside) for (const each of [beside.area, beside.pixel]) each.remove();
    else if (!beside.area.isConnected) {
      pictures.append(beside.area);
      stage.pixel.after(beside.pixel);
    }
  }

  // Shows what the user chose, and puts it into the address.
  function choose(wanted) {
    context.remember(imagesText(wanted));
    look(wanted);
  }

  function end() {
    for (const stop of stops.splice(0)) stop();
    for (const each of [stage, beside]) each.clear();
    hint.hidden = false;
    delete hint.dataset.shown;
    why.offer("");
  }

  // Shows why a topic cannot be shown.
  function refuse(text) {
    end();
    replace(hint, text);
  }

  function look(wanted) {
    end();
    shown = wanted;
    const { topic, other } = shown;
    error.show();
    replace(figures);
    drawChoices();
    replace(hint, !topic ? CHOOSE : playback.bag ? "The bag has no image before this moment." : "No image received yet.");
    why.offer(topic);
    if (!topic) return;
    if (other) stops.push(context.watch("image_pair", { name: topic, other }, take, fail));
    else stops.push(context.watch("image", { name: topic }, take, fail));
    const overlayFails = error.show;
    if (shown.overlay) stops.push(context.watch("image_overlay", { name: shown.overlay, image: topic }, drawOver, overlayFails));
  }

  function drawOver(data) {
    stage.over(data.over);
    error.show(data.error);
  }

  // Shows why there is no picture; the last one would look like the present one.
  function fail(problem) {
    error.show(problem);
    if (problem) for (const each of [stage, beside]) each.blank();
    hint.hidden = Boolean(problem) || !stage.canvas.hidden;
  }

  // Shows why there is no picture, until the next message.
  function takeNothing(data) {
    if (data.error) fail(data.error);
    else replace(hint, unmatchedText(data));
  }

  async function take(data) {
    if (!(data instanceof DataView)) { takeNothing(data); return; }
    const wanted = shown;
    const [one, other] = shown.other ? pairIn(data) : [data];
    let head = headOf(one);
    const refusal = unsupportedTransport({ name: shown.topic, type: head.format ?? "" });
    if (refusal) { refuse(refusal); return; }
    try {
      head = shown.isDifference ? await stage.showDifference(one, other) : await stage.show(one);
      if (other && !shown.isDifference) await beside.show(other);
      hint.hidden = true;
      why.offer("");
      if (!shown.overlay) error.show();
    } catch (problem) {
      if (shown === wanted) fail(`The image cannot be shown: ${problem.message}`);
    }
    if (shown === wanted) replace(figures, figuresOf(head, other ? headOf(data).apart : null));
  }

  context.onSource(() => { for (const each of [stage, beside]) each.blank(); });
  drawChoices();
  if (shown.topic) look(shown);
  return { go: (text) => look(parsedImages(text)) };
}

const unmatchedText = ({ counts, within }) =>
  `No pair yet: ${counts[0]} and ${counts[1]} images were received, but no two within ${within} s.`;

function figuresOf({ full, encoding, format, frame, rate, bandwidth: size }, apart) {
  const what = `${full?.join(" × ") ?? ""} ${encoding ?? format}${frame ? `, ${frame}` : ""}`;
  const text = rateText(`${hertz(rate)} · ${bandwidth(size)}`);
  return [`${what} · `, text, apart === null ? null : ` · ${(apart * 1000).toFixed(1)} ms apart`];
}

// The two images in a pair.
function pairIn(data) {
  const { sizes } = headOf(data);
  const all = new Uint8Array(data.buffer, data.byteOffset);
  const begin = data.byteOffset + all.indexOf(10) + 1;
  return [new DataView(data.buffer, begin, sizes[0]), new DataView(data.buffer, begin + sizes[0], sizes[1])];
}

// Shows a choice of topics as a hint.
function offer(hint, names, onChoose) {
  if (hint.dataset.shown === names.join()) return;
  hint.dataset.shown = names.join();
  replace(hint, names.length ? `${CHOOSE}: there are ${names.length} image topics.` : "There are no image topics.",
    h("div", { class: "choice" }, names.map((name) => h("button", { onclick: () => onChoose(name) }, name))));
}
