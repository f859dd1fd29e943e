// The timeline: a bar for each object, a dot for each event, a slider for the time.

const timeline = $("timeline"), lanes = $("lanes");
const percent = seconds => `${100 * Math.min(Math.max(seconds / duration, 0), 1)}%`;
const laneOf = [];
for (const object of objects) {
  // Events may be a little before and after the sight of which they tell.
  const times = object.events.map(([time]) => time);
  let lane = laneOf.findIndex(end => end < Math.min(object.first, ...times));
  if (lane < 0) lane = laneOf.length;
  laneOf[lane] = Math.max(object.last, ...times) + 0.004 * duration;
  object.lane = lane;
}
const laneHeight = laneOf.length > 8 ? 12 : 20;
lanes.style.height = `${Math.max(1, laneOf.length) * laneHeight}px`;
for (const object of objects) {
  const first = outputTime(object.first), last = outputTime(object.last) + 1 / data.fps;
  const bar = make("div", {className: "object", textContent: object.seen > 0.02 * duration ? String(object.number) : "",
    title: `Object ${object.number}: ${clockText(object.first)} to ${clockText(object.last)}`});
  Object.assign(bar.style, {left: percent(first), width: percent(last - first), top: `${object.lane * laneHeight + 1}px`,
    height: `${laneHeight - 2}px`, background: object.colour, color: inkOn(object.colour)});
  bar.dataset.number = object.number;
  object.bar = bar;
  lanes.append(bar);
  for (const [time, , words] of object.events) {
    const dot = make("div", {className: "event", title: `${clockText(time)} ${words}`});
    Object.assign(dot.style, {left: `clamp(4px, ${percent(outputTime(time))}, 100% - 4px)`, top: `${object.lane * laneHeight + laneHeight / 2 - 3.5}px`});
    lanes.append(dot);
  }
}
const niceStep = (span, most) => {
  const rough = span / most, ten = 10 ** Math.floor(Math.log10(rough || 1));
  return [1, 2, 5, 10].map(factor => factor * ten).find(step => step >= rough);
};
const timeSteps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800, 3600];
const timeStep = (span, most) => timeSteps.find(step => step >= span / most) || niceStep(span, most);
const shortTime = (seconds, every) => every < 1 ? clockText(seconds) : clockText(seconds).slice(0, -3);
const labelTimeline = () => {
  const every = timeStep(duration, Math.max(2, timeline.clientWidth / 90));
  $("marks").replaceChildren();
  for (let time = Math.ceil(data.start / every) * every; time < data.start + duration * 0.97; time += every) {
    const mark = make("span", {textContent: shortTime(time, every)});
    mark.style.left = percent(outputTime(time));
    $("marks").append(mark);
  }
};
timeline.setAttribute("aria-valuemin", "0");
timeline.setAttribute("aria-valuemax", duration.toFixed(2));
const timeAt = event => {
  const box = timeline.getBoundingClientRect();
  return Math.min(Math.max((event.clientX - box.left) / timeline.clientWidth, 0), 1) * duration;
};
let dragging = false;
timeline.addEventListener("pointerdown", event => {
  if (event.button || event.clientX > timeline.getBoundingClientRect().left + timeline.clientWidth) return;
  dragging = event.pointerType === "mouse";
  if (dragging) timeline.setPointerCapture(event.pointerId);
  if (event.target.dataset.number) choose(Number(event.target.dataset.number));
  seek(timeAt(event));
});
timeline.addEventListener("pointermove", event => { if (dragging) seek(timeAt(event)); });
for (const name of ["pointerup", "pointercancel"]) timeline.addEventListener(name, () => { dragging = false; });
