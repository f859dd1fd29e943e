// What changes with time, and keys; begins everything.

const show = (time = player.currentTime) => {
  draw(time);
  $("cursor").style.left = percent(time);
  const frame = Math.min(Math.floor(time * data.fps + 1e-6), data.frames - 1), now = inputTime(frame / data.fps);
  $("clock").textContent = clockText(now);
  timeline.setAttribute("aria-valuenow", time.toFixed(2));
  timeline.setAttribute("aria-valuetext", clockText(now));
  for (const plot of plots) plot.mark(time);
};
if (video && video.requestVideoFrameCallback) {
  const each = (now, told) => { if (!player.paused) show(told.mediaTime + 0.5 / data.fps); video.requestVideoFrameCallback(each); };
  video.requestVideoFrameCallback(each);
}
for (const name of ["timeupdate", "seeked", "loadeddata"]) player.addEventListener(name, () => show());
for (const name of ["play", "pause", "ended"]) {
  player.addEventListener(name, () => {
    $("play").textContent = player.paused ? "Play" : "Pause";
    $("play").setAttribute("aria-pressed", String(!player.paused));
  });
}
$("play").addEventListener("click", toggle);
$("back").addEventListener("click", () => step(-1));
$("forward").addEventListener("click", () => step(1));
$("speed").addEventListener("change", () => { player.playbackRate = Number($("speed").value); });
$("sound").addEventListener("change", () => { video.muted = !$("sound").checked; });
for (const id of ["outlines", "boxes", "paths"]) $(id).addEventListener("change", () => draw(player.currentTime));
document.addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input, select, button")) return;
  const moves = {ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageUp: 10, PageDown: -10};
  if (event.key === " ") toggle();
  else if (event.key === ",") step(-1);
  else if (event.key === ".") step(1);
  else if (event.target === timeline && event.key in moves) seek(player.currentTime + moves[event.key]);
  else if (event.target === timeline && event.key === "Home") seek(0);
  else if (event.target === timeline && event.key === "End") seek(duration);
  else return;
  event.preventDefault();
});
let pending = 0;
new ResizeObserver(() => {
  cancelAnimationFrame(pending);
  pending = requestAnimationFrame(() => { labelTimeline(); for (const plot of plots) plot.draw(); show(); });
}).observe(document.body);

$("between").hidden = !data.pairs.length;
if (data.pairs.length) {
  fillSelect($("first"), [...partners.keys()].sort((a, b) => a - b).filter(number => number > 0), chosen);
  chooseFirst();
}
refreshTable();
labelTimeline();
choose(chosen);
show();
// An address that ends in #t=12.5 shows that moment of the input.
const jump = () => {
  const wanted = /^#t=(\d+(?:\.\d+)?)$/.exec(location.hash);
  if (wanted) seek(outputTime(Number(wanted[1])));
};
if (video && !video.readyState) video.addEventListener("loadedmetadata", jump, {once: true});
else jump();
window.addEventListener("hashchange", jump);
