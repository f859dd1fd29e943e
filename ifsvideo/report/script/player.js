// The player: the video, or a clock where there is none.

class Clock extends EventTarget {
  constructor() { super(); this.paused = true; this.playbackRate = 1; this.at = 0; }
  get currentTime() { return this.at; }
  set currentTime(time) { this.at = Math.min(Math.max(time, 0), duration); this.tell("seeked"); }
  tell(name) { this.dispatchEvent(new Event(name)); }
  play() {
    this.paused = false; this.tell("play");
    let before = performance.now();
    const step = now => {
      if (this.paused) return;
      this.at += (now - before) / 1000 * this.playbackRate; before = now;
      if (this.at >= duration) { this.at = duration; this.pause(); return; }
      this.tell("timeupdate"); requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
    return Promise.resolve();
  }
  pause() { this.paused = true; this.tell("pause"); }
}
const video = $("video"), player = video || new Clock();
const stage = $("stage"), drawing = $("drawing");
const ratio = data.width * data.aspect / data.height;
stage.style.aspectRatio = String(ratio);
stage.style.maxWidth = `calc(70vh * ${ratio})`;
if (video) {
  video.removeAttribute("controls");
  $("sounding").hidden = video.muted;
  video.addEventListener("error", () => {
    stage.after(make("p", {className: "help", role: "alert",
      textContent: "The video cannot be played; keep the file that was written beside this page in the same folder."}));
  });
}
const seek = seconds => {
  // The middle of a picture: at its very beginning, rounding may show the one before.
  const frame = Math.min(Math.max(Math.floor(seconds * data.fps + 1e-6), 0), data.frames - 1);
  player.currentTime = (frame + 0.5) / data.fps;
  show();
};
const step = pictures => { player.pause(); seek((Math.floor(player.currentTime * data.fps + 1e-6) + pictures) / data.fps); };
const toggle = () => { if (player.paused) player.play().catch(() => {}); else player.pause(); };
