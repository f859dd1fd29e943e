// A curve over time.

const svg = (name, attributes, parent, text) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const key in attributes) element.setAttribute(key, attributes[key]);
  if (text !== undefined) element.textContent = text;
  if (parent) parent.append(element);
  return element;
};
const plots = [];
class Plot {
  constructor(name, title, unit) {
    this.svg = $(`${name}-plot`); this.words = $(`${name}-words`); this.title = title; this.unit = unit;
    this.series = [];
    this.svg.addEventListener("click", event => {
      const box = this.svg.getBoundingClientRect();
      if (this.range) seek(outputTime(this.range[0] + (event.clientX - box.left - 44) / (box.width - 54) * (this.range[1] - this.range[0])));
    });
    plots.push(this);
  }
  // Rows of [input time, value or null, whether it follows the row before], and the range of time.
  set(series, range, missing) {
    this.series = series; this.range = range;
    const known = series.filter(row => row[1] !== null);
    this.words.textContent = known.length ? this.inWords(known) : missing;
    this.svg.setAttribute("aria-label", `${this.title}. ${this.words.textContent}`);
    this.draw();
  }
  inWords(known) {
    let low = known[0], high = known[0];
    for (const row of known) { if (row[1] < low[1]) low = row; if (row[1] > high[1]) high = row; }
    const told = row => `${row[1].toFixed(2)} ${this.unit} at ${clockText(row[0])}`;
    return `Lowest ${told(low)}, highest ${told(high)}.`;
  }
  draw() {
    const width = this.svg.clientWidth || 400, height = this.svg.clientHeight || 190;
    this.svg.replaceChildren();
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.cursor = null;
    const values = this.series.filter(row => row[1] !== null).map(row => row[1]);
    if (!values.length) { svg("text", {x: width / 2, y: height / 2, "text-anchor": "middle"}, this.svg, "nothing to show"); return; }
    let low = Math.min(0, ...values), high = Math.max(0, ...values);
    if (high - low < 1e-6) high = low + 1;
    const tick = niceStep(high - low, 4);
    low = Math.floor(low / tick + 1e-9) * tick; high = Math.ceil(high / tick - 1e-9) * tick;
    const [begin, end] = this.range;
    const x = time => 44 + (time - begin) / Math.max(end - begin, 1e-6) * (width - 54);
    const y = value => height - 22 - (value - low) / (high - low) * (height - 32);
    for (let value = low; value <= high + tick / 2; value += tick) {
      svg("line", {class: "grid", x1: 44, x2: width - 10, y1: y(value), y2: y(value)}, this.svg);
      svg("text", {x: 40, y: y(value) + 4, "text-anchor": "end"}, this.svg, String(Number(value.toPrecision(4))));
    }
    const every = timeStep(end - begin, Math.max(2, width / 90));
    for (let time = Math.ceil(begin / every - 1e-9) * every; time <= end + 1e-9; time += every) {
      svg("text", {x: x(time), y: height - 6, "text-anchor": x(time) > width - 30 ? "end" : "middle"}, this.svg, shortTime(time, every));
    }
    let path = "", open = false;
    for (const [time, value, follows] of this.series) {
      if (value === null) { open = false; continue; }
      path += `${open && follows ? "L" : "M"}${x(time).toFixed(1)} ${y(value).toFixed(1)}`;
      if (!(open && follows)) path += "h0.01";
      open = true;
    }
    svg("path", {class: "curve", d: path, "stroke-linecap": "round"}, this.svg);
    this.cursor = svg("line", {class: "now", y1: 8, y2: height - 22}, this.svg);
    this.x = x;
    this.mark(player.currentTime);
  }
  mark(time) {
    if (!this.cursor) return;
    const at = inputTime(time), inside = at >= this.range[0] && at <= this.range[1] + 1 / data.fps;
    this.cursor.setAttribute("visibility", inside ? "visible" : "hidden");
    for (const end of ["x1", "x2"]) this.cursor.setAttribute(end, this.x(Math.min(Math.max(at, this.range[0]), this.range[1])));
  }
}
